/* Points at the time of display: follows pixels of the first left image, and says of each frame
 * where they are when it is shown.
 *   display_points LEFT RIGHT FX,FY,CX,CY,BASELINE_MM POINTS.csv DELAY_MS OUT.csv [DEVICE_ID]
 * POINTS.csv has the columns id,u,v (px). DELAY_MS, at most 100, is the time from when a frame was
 * taken to when the screen shows what is drawn for it. OUT.csv has the position of each point that
 * long after each frame, with the error to be expected then: mm, rectified left camera. */
#include <stdlib.h>

#include "points.h"

static defrec_predictor make_predictor(size_t count) {
    defrec_predictor_desc desc;
    defrec_predictor predictor;
    DEFREC_INIT(&desc);
    desc.point_count = count;
    check(defrec_predictor_create(&desc, &predictor), "making the predictor");
    return predictor;
}

/* Every frame is told, also one that is lost: what came before it is no motion then. */
static void tell(defrec_predictor predictor, const followed_points* points,
                 const defrec_result* result) {
    defrec_predictor_frame frame;
    size_t i;
    DEFREC_INIT(&frame);
    frame.timestamp_ns = result->timestamp_ns;
    frame.state = result->state;
    frame.epoch = result->epoch;
    frame.count = points->count;
    if (points->is_known) {
        for (i = 0; i < points->count; ++i)
            if (points->found[i] == 0) points->status[i] = DEFREC_POINT_UNKNOWN;
        frame.xyz = points->now;
        frame.status = points->status;
        frame.expected_error_mm = points->expected_error_mm;
    } else {
        frame.state = DEFREC_INITIALISING; /* there is no template yet, so no place either */
    }
    check(defrec_predictor_add_frame(predictor, &frame), "telling where the points are");
}

int main(int argc, char** argv) {
    stereo_sequence sequence;
    followed_points points;
    tracking running;
    defrec_predictor predictor;
    double delay_ms = 0;
    char rest = 0;
    FILE* out;
    size_t i;
    if (argc < 7 || argc > 8 || sscanf(argv[5], "%lf%c", &delay_ms, &rest) != 1 ||
        !(delay_ms >= 0 && delay_ms <= DEFREC_MAX_PREDICTION_MS)) {
        fprintf(stderr,
                "usage: display_points LEFT RIGHT FX,FY,CX,CY,BASELINE_MM POINTS.csv DELAY_MS "
                "OUT.csv [DEVICE_ID]\n");
        return 2;
    }
    sequence = open_sequence(argv[1], argv[2]);
    points = read_points(argv[4]);
    out = fopen(argv[6], "w");
    if (out == NULL) fail("%s: cannot be written", argv[6]);
    write_header(out);
    running = open_tracking(argv[3], &sequence.left, argc == 8 ? argv[7] : NULL, 0);
    predictor = make_predictor(points.count);

    for (i = 0; i < frame_count(&sequence); ++i) {
        defrec_result result;
        defrec_job job;
        read_frame(&sequence, i);
        job = track(&running, &sequence, timestamp_of(i), &result);
        follow(&points, &running, job, &result);
        tell(predictor, &points, &result);
        /* A live program asks when it draws, with the time at which the screen shows it. */
        check(defrec_predictor_predict(
                  predictor, result.timestamp_ns + (int64_t)(delay_ms * 1e6 + 0.5), points.count,
                  points.now, points.status, points.expected_error_mm, NULL),
              "predicting the points");
        write_points(out, i, &points);
        defrec_job_release(job);
    }
    if (fclose(out) != 0) fail("%s: could not be written to its end", argv[6]);

    defrec_predictor_destroy(predictor);
    close_tracking(&running);
    free_points(&points);
    close_sequence(&sequence);
    return 0;
}
