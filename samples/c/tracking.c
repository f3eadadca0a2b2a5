#include "tracking.h"

#include <stdio.h>

tracking open_tracking(const char* camera_text, const image* view, const char* device_id,
                       uint32_t frames_in_flight) {
    const defrec_rig_desc rig_desc = parse_camera(camera_text, view->width, view->height);
    defrec_rig_info rig_info;
    defrec_tracker_desc tracker_desc;
    tracking opened;
    check(defrec_context_create(NULL, &opened.context), "loading the plugins");
    check(defrec_rig_create(opened.context, &rig_desc, &opened.rig), "making the rig");
    DEFREC_INIT(&rig_info);
    check(defrec_rig_get(opened.rig, &rig_info), "reading the rig");
    opened.camera = rig_info.camera;
    DEFREC_INIT(&tracker_desc);
    tracker_desc.device_id = device_id;
    tracker_desc.frames_in_flight = frames_in_flight;
    check(defrec_tracker_create(opened.context, opened.rig, &tracker_desc, &opened.tracker),
          "making the tracker");
    return opened;
}

defrec_status submit_views(const tracking* running, const defrec_image* left,
                           const defrec_image* right, int64_t timestamp_ns, defrec_job* job) {
    defrec_frame frame;
    DEFREC_INIT(&frame);
    frame.timestamp_ns = timestamp_ns;
    frame.left = left;
    frame.right = right;
    return defrec_tracker_submit(running->tracker, &frame, job);
}

defrec_status submit(const tracking* running, const image* left, const image* right,
                     int64_t timestamp_ns, defrec_job* job) {
    const defrec_image left_view = view_of(left, DEFREC_FORMAT_BGR8),
                       right_view = view_of(right, DEFREC_FORMAT_BGR8);
    return submit_views(running, &left_view, &right_view, timestamp_ns, job);
}

defrec_job track(const tracking* running, const stereo_sequence* sequence, int64_t timestamp_ns,
                 defrec_result* result) {
    defrec_job job;
    check(submit(running, &sequence->left, &sequence->right, timestamp_ns, &job),
          "submitting a frame");
    check(defrec_job_wait(job, UINT64_MAX), "tracking a frame");
    DEFREC_INIT(result);
    check(defrec_job_result(job, result), "reading the result");
    return job;
}

void wait_for_body(defrec_template surface) {
    const defrec_status status = defrec_template_wait_body(surface, UINT64_MAX);
    if (status != DEFREC_ERROR_UNSUPPORTED) check(status, "computing the body beneath the surface");
}

int is_given_up(const defrec_result* result, size_t frame) {
    if (result->vertex_count > 0) return 0;
    fprintf(stderr,
            "frame %zu: the template was given up; the targets are lost until they are registered "
            "to another\n",
            frame);
    return 1;
}

void close_tracking(tracking* running) {
    defrec_tracker_destroy(running->tracker);
    defrec_rig_destroy(running->rig);
    defrec_context_destroy(running->context);
}
