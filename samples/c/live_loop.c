/* How a navigation system uses defrec: a camera delivers frames at its own pace, and the loop takes
 * the newest frame, waits for its result until a deadline, and goes on with what is there.
 *   live_loop LEFT RIGHT FX,FY,CX,CY,BASELINE_MM DEADLINE_MS [DEVICE_ID]
 * The camera is a thread that reads a sequence at 30 frames a second. One line is printed for each
 * result: in time, or late. */
#define _POSIX_C_SOURCE 200809L
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "tracking.h"

static int64_t now_ns(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (int64_t)time.tv_sec * 1000000000 + time.tv_nsec;
}

/* ---- the camera ---- */

typedef struct {
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    stereo_sequence sequence;
    image left, right; /* the newest frame's; exchanged, not copied */
    size_t frame;      /* its number */
    int64_t arrived_ns;
    int is_new, has_ended;
} camera;

static void exchange(image* a, image* b) {
    const image kept = *a;
    *a = *b;
    *b = kept;
}

static void* deliver_frames(void* argument) {
    camera* source = argument;
    const int64_t start = now_ns();
    size_t i;
    for (i = 0; i < frame_count(&source->sequence); ++i) {
        const int64_t due = start + timestamp_of(i);
        const struct timespec until = {(time_t)(due / 1000000000), (long)(due % 1000000000)};
        read_frame(&source->sequence, i);
        clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
        pthread_mutex_lock(&source->mutex);
        exchange(&source->left, &source->sequence.left);
        exchange(&source->right, &source->sequence.right);
        source->frame = i;
        source->arrived_ns = now_ns();
        source->is_new = 1;
        pthread_cond_signal(&source->changed);
        pthread_mutex_unlock(&source->mutex);
    }
    pthread_mutex_lock(&source->mutex);
    source->has_ended = 1;
    pthread_cond_signal(&source->changed);
    pthread_mutex_unlock(&source->mutex);
    return NULL;
}

typedef struct {
    image left, right;
    size_t number;
    int64_t arrived_ns;
} camera_frame;

/* 0: the camera has ended. */
static int take_newest(camera* source, camera_frame* out) {
    int is_new;
    pthread_mutex_lock(&source->mutex);
    while (!source->is_new && !source->has_ended)
        pthread_cond_wait(&source->changed, &source->mutex);
    is_new = source->is_new;
    if (is_new) {
        exchange(&out->left, &source->left);
        exchange(&out->right, &source->right);
        out->number = source->frame;
        out->arrived_ns = source->arrived_ns;
        source->is_new = 0;
    }
    pthread_mutex_unlock(&source->mutex);
    return is_new;
}

/* ---- the loop ---- */

enum { PLACES = 2 }; /* frames submitted and not yet released; the tracker's default */

typedef struct {
    defrec_job job;
    size_t number;
    int64_t deadline_ns;
} pending_result;

static const struct {
    uint32_t reason;
    const char* name;
} reason_names[] = {
    /* By scripts/contract/generate.py: every reason. */
    {DEFREC_REASON_DARK, "dark"},
    {DEFREC_REASON_SATURATED, "saturated"},
    {DEFREC_REASON_NO_TEXTURE, "no texture"},
    {DEFREC_REASON_FEW_MATCHES, "few matches"},
    {DEFREC_REASON_OCCLUDED, "occluded"},
    {DEFREC_REASON_LARGE_RESIDUAL, "large residual"},
    {DEFREC_REASON_FAST_MOTION, "fast motion"},
    {DEFREC_REASON_OUT_OF_VIEW, "out of view"},
    {DEFREC_REASON_NO_DEPTH, "no depth"},
    {DEFREC_REASON_ONE_VIEW, "one view"},
    {DEFREC_REASON_FROZEN, "frozen"},
    {DEFREC_REASON_GAP, "gap"},
    {DEFREC_REASON_VIEWS_SWAPPED, "views swapped"},
    {DEFREC_REASON_LOW_CONTRAST, "low contrast"},
    {DEFREC_REASON_VIEW_LATE, "view late"},
    {DEFREC_REASON_CALIBRATION, "calibration"},
    {DEFREC_REASON_TEMPLATE_GREW, "template grew"},
    {DEFREC_REASON_TEMPLATE_FULL, "template full"},
    {DEFREC_REASON_COARSE, "coarse"},
    {DEFREC_REASON_UNCHECKED, "unchecked"},
    {DEFREC_REASON_OVERDUE, "overdue"},
    {DEFREC_REASON_CUT, "cut"},
    {DEFREC_REASON_PIECE_LOST, "piece lost"},
    {DEFREC_REASON_INTERLACED, "interlaced"},
    {DEFREC_REASON_CONTRADICTED, "contradicted"},
    {DEFREC_REASON_DISPARITY, "disparity"},
};

static void show_reasons(uint32_t reasons) {
    const char* separator = ": ";
    size_t i;
    for (i = 0; i < sizeof reason_names / sizeof *reason_names; ++i)
        if ((reasons & reason_names[i].reason) != 0) {
            printf("%s%s", separator, reason_names[i].name);
            separator = ", ";
            reasons &= ~reason_names[i].reason;
        }
    if (reasons != 0) printf("%sothers (0x%x)", separator, reasons); /* of a later library */
}

static const char* state_name(uint32_t state) {
    switch (state) {
        case DEFREC_INITIALISING:
            return "initialising";
        case DEFREC_TRACKING:
            return "tracking";
        case DEFREC_DEGRADED:
            return "degraded";
        case DEFREC_LOST:
            return "lost";
        case DEFREC_RELOCALISED:
            return "relocalised";
        default:
            return "unknown"; /* of a later library */
    }
}

/* What a display does with a result: a frame that is tracked or degraded moves the plan; a lost one
 * hides it, or shows it as old. */
static void show(const pending_result* pending) {
    defrec_result result;
    DEFREC_INIT(&result);
    check(defrec_job_result(pending->job, &result), "reading the result");
    printf("frame %zu %s: %s", pending->number,
           now_ns() <= pending->deadline_ns ? "in time" : "late", state_name(result.state));
    show_reasons(result.reasons);
    printf("\n");
}

/* Shows the results that are done by the deadline, oldest first, and releases their places. */
static void take_results(pending_result* pending, size_t* count, int64_t until_ns) {
    while (*count > 0) {
        const int64_t left_ns = until_ns - now_ns();
        const defrec_status status =
            defrec_job_wait(pending[0].job, left_ns > 0 ? (uint64_t)left_ns : 0);
        if (status == DEFREC_TIMEOUT) return;
        check(status, "tracking a frame");
        show(&pending[0]);
        defrec_job_release(pending[0].job);
        memmove(pending, pending + 1, --*count * sizeof *pending);
    }
}

/* Tracks what the camera delivers until it ends; returns the number of frames tracked. */
static size_t follow(camera* source, const tracking* running, double deadline_ms) {
    camera_frame newest;
    pending_result pending[PLACES];
    size_t pending_count = 0, submitted = 0;
    memset(&newest, 0, sizeof newest);
    while (take_newest(source, &newest)) {
        pending_result next;
        defrec_status status;
        take_results(pending, &pending_count, 0); /* late results */
        status = submit(running, &newest.left, &newest.right, newest.arrived_ns, &next.job);
        if (status == DEFREC_ERROR_BUSY) continue; /* both places are taken; the frame is dropped */
        check(status, "submitting a frame");
        ++submitted;
        next.number = newest.number;
        next.deadline_ns = newest.arrived_ns + (int64_t)(deadline_ms * 1e6);
        pending[pending_count++] = next;
        take_results(pending, &pending_count, next.deadline_ns);
    }
    take_results(pending, &pending_count, INT64_MAX);
    free(newest.left.pixels);
    free(newest.right.pixels);
    return submitted;
}

int main(int argc, char** argv) {
    camera source;
    pthread_t camera_thread;
    size_t submitted;
    double deadline_ms = 0;
    char rest = 0;
    tracking running;
    if (argc < 5 || argc > 6 || sscanf(argv[4], "%lf%c", &deadline_ms, &rest) != 1 ||
        !(deadline_ms >= 0 && deadline_ms <= 60000)) {
        fprintf(stderr,
                "usage: live_loop LEFT RIGHT FX,FY,CX,CY,BASELINE_MM DEADLINE_MS [DEVICE_ID]\n");
        return 2;
    }
    memset(&source, 0, sizeof source);
    source.sequence = open_sequence(argv[1], argv[2]);
    pthread_mutex_init(&source.mutex, NULL);
    pthread_cond_init(&source.changed, NULL);

    /* Everything that takes long is done before the camera runs: plugins, device, memory. */
    running = open_tracking(argv[3], &source.sequence.left, argc == 6 ? argv[5] : NULL, PLACES);
    if (pthread_create(&camera_thread, NULL, deliver_frames, &source) != 0)
        fail("no thread for the camera");
    submitted = follow(&source, &running, deadline_ms);
    pthread_join(camera_thread, NULL);
    printf("%zu frames from the camera, %zu tracked, %zu dropped\n", frame_count(&source.sequence),
           submitted, frame_count(&source.sequence) - submitted);

    close_tracking(&running);
    pthread_cond_destroy(&source.changed);
    pthread_mutex_destroy(&source.mutex);
    close_sequence(&source.sequence);
    free(source.left.pixels);
    free(source.right.pixels);
    return 0;
}
