/* A tracker with what it needs, and frames through it: what the samples of tracking share. */
#ifndef DEFREC_SAMPLES_TRACKING_H
#define DEFREC_SAMPLES_TRACKING_H
#include "input.h"

typedef struct {
    defrec_context context;
    defrec_rig rig;
    defrec_camera camera; /* the rectified left one */
    defrec_tracker tracker;
} tracking;
/* For views of the image's size. camera_text: "FX,FY,CX,CY,BASELINE_MM"; device_id: NULL: the
 * fastest; frames_in_flight: 0: the default. */
tracking open_tracking(const char* camera_text, const image* view, const char* device_id,
                       uint32_t frames_in_flight);
/* The tracker copies the pixels. DEFREC_ERROR_BUSY: all its places are taken. */
defrec_status submit_views(const tracking* running, const defrec_image* left,
                           const defrec_image* right, int64_t timestamp_ns, defrec_job* job);
defrec_status submit(const tracking* running, const image* left, const image* right,
                     int64_t timestamp_ns, defrec_job* job);
/* Tracks the pair that was read last, and waits for the result. The job must be released. */
defrec_job track(const tracking* running, const stereo_sequence* sequence, int64_t timestamp_ns,
                 defrec_result* result);
/* Waits for the body beneath the surface, as results of a recording must not depend on when it is
 * ready. A live loop goes on meanwhile: defrec_result.body says whether it is. A template of which
 * no body can be made moves points rigidly beneath its surface. */
void wait_for_body(defrec_template surface);
/* Whether a tracker that had a template has none in this frame: it was given up, which is said on
 * standard error. All in its frame of reference is void then, and the next template needs a
 * registration of its own. */
int is_given_up(const defrec_result* result, size_t frame);
void close_tracking(tracking* running);
#endif
