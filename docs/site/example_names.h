/* What the fragments of the guides use without declaring it. Nothing of this is defined anywhere:
 * fragments are compiled, not run. */
#ifndef DEFREC_EXAMPLE_NAMES_H
#define DEFREC_EXAMPLE_NAMES_H
#include <defrec_c.h>
#include <stdio.h>

void check(defrec_status status);
void report(defrec_status status, const char* text);
void show(defrec_job job);
defrec_frame newest_frame(void);
uint64_t clock_ns(void);

/* After a program these are its own. */
#ifndef EXAMPLE_AFTER_PROGRAM
extern defrec_context context;
extern defrec_rig rig;
extern defrec_rig_desc rig_desc;
extern defrec_tracker tracker;
extern defrec_tracker_desc desc, tracker_desc;
#endif
extern defrec_frame frame;
extern defrec_job job, pending[16];
extern defrec_result result;
extern defrec_memory surface;
extern size_t pending_count;

/* Images. */
extern uint32_t width, height;
extern uint64_t stride;
extern const void *left_pixels, *right_pixels;
extern int64_t now;

/* Images in device memory. */
extern struct {
    void* pixels;
    defrec_memory memory;
} slots[4];
extern size_t l, r, pitch;
extern void* producer;
void cudaStreamSynchronize(void* stream);

/* A preoperative model. */
extern size_t count;
extern double tumour[], moved[], expected_error_mm[];
extern uint8_t status[];
void room_for_points(size_t count, double** moved, uint8_t** status, double** expected_error_mm);
#endif
