/* Follows pixels of the first left image through a stereo sequence.
 *   track_folder LEFT RIGHT FX,FY,CX,CY,BASELINE_MM POINTS.csv OUT.csv [DEVICE_ID]
 * POINTS.csv has the columns id,u,v (px). OUT.csv has the position of each point in each frame: mm,
 * rectified left camera. */
#include <stdio.h>

#include "points.h"

int main(int argc, char** argv) {
    stereo_sequence sequence;
    tracking running;
    followed_points points;
    FILE* out;
    size_t i;
    if (argc < 6 || argc > 7) {
        fprintf(stderr,
                "usage: track_folder LEFT RIGHT FX,FY,CX,CY,BASELINE_MM POINTS.csv OUT.csv "
                "[DEVICE_ID]\n");
        return 2;
    }
    sequence = open_sequence(argv[1], argv[2]);
    points = read_points(argv[4]);
    out = fopen(argv[5], "w");
    if (out == NULL) fail("%s: cannot be written", argv[5]);
    write_header(out);

    running = open_tracking(argv[3], &sequence.left, argc == 7 ? argv[6] : NULL, 0);

    for (i = 0; i < frame_count(&sequence); ++i) {
        defrec_result result;
        defrec_job job;
        read_frame(&sequence, i);
        job = track(&running, &sequence, timestamp_of(i), &result);

        follow(&points, &running, job, &result);
        write_points(out, i, &points);
        defrec_job_release(job);
    }
    if (fclose(out) != 0) fail("%s: could not be written to its end", argv[5]);

    close_tracking(&running);
    free_points(&points);
    close_sequence(&sequence);
    return 0;
}
