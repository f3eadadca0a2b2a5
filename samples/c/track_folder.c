/* Follows pixels of the first left image through a stereo sequence.
 *   track_folder LEFT RIGHT FX,FY,CX,CY,BASELINE_MM POINTS.csv OUT.csv [DEVICE_ID]
 * POINTS.csv has the columns id,u,v (px). OUT.csv has the position of each point in each frame: mm,
 * rectified left camera. */
#include <stdio.h>
#include <stdlib.h>

#include "tracking.h"

typedef struct {
    size_t count;
    long* id;
    double* uv;
    uint8_t* found;  /* 1: the template has a surface there */
    double* at_rest; /* xyz, template frame */
    double* now;     /* xyz, rectified left camera of the frame */
    uint8_t* status;
    double* expected_error_mm;
} followed_points;

static void* allocate(size_t count, size_t size) {
    void* memory = calloc(count, size);
    if (memory == NULL) fail("out of memory");
    return memory;
}

static followed_points read_points(const char* path) {
    enum { MOST = 1000000 };
    followed_points points;
    char line[256];
    FILE* file = fopen(path, "r");
    if (file == NULL || fgets(line, sizeof line, file) == NULL) fail("%s: cannot be read", path);
    points.count = 0;
    while (fgets(line, sizeof line, file) != NULL) ++points.count;
    if (points.count == 0 || points.count > MOST) fail("%s: 1 to %d points expected", path, MOST);
    points.id = allocate(points.count, sizeof *points.id);
    points.uv = allocate(points.count, 2 * sizeof *points.uv);
    points.found = allocate(points.count, 1);
    points.at_rest = allocate(points.count, 3 * sizeof *points.at_rest);
    points.now = allocate(points.count, 3 * sizeof *points.now);
    points.status = allocate(points.count, 1);
    points.expected_error_mm = allocate(points.count, sizeof *points.expected_error_mm);
    rewind(file);
    points.count = 0;
    fgets(line, sizeof line, file); /* the header */
    while (fgets(line, sizeof line, file) != NULL) {
        double* uv = points.uv + 2 * points.count;
        char rest;
        line[strcspn(line, "\r\n")] = '\0';
        if (sscanf(line, "%ld,%lf,%lf %c", &points.id[points.count], &uv[0], &uv[1], &rest) != 3)
            fail("%s: id,u,v expected, found \"%s\"", path, line);
        ++points.count;
    }
    fclose(file);
    return points;
}

static void free_points(followed_points* points) {
    free(points->id);
    free(points->uv);
    free(points->found);
    free(points->at_rest);
    free(points->now);
    free(points->status);
    free(points->expected_error_mm);
}

/* Lifts the pixels to the surface, once there is one. */
static void lift(followed_points* points, defrec_rig rig, defrec_tracker tracker) {
    defrec_template surface;
    check(defrec_rig_rectify_pixels(rig, points->uv, points->count, points->uv),
          "rectifying the points");
    check(defrec_tracker_get_template(tracker, &surface), "reading the template");
    /* Results of a recording must not depend on when the body beneath it is ready. */
    check(defrec_template_wait_body(surface, UINT64_MAX), "computing the body beneath the surface");
    check(defrec_template_lift(surface, points->uv, points->count, points->at_rest, points->found),
          "finding the surface under the points");
    defrec_template_release(surface);
}

static void write_points(FILE* file, size_t frame, const followed_points* points, int is_known) {
    size_t i;
    for (i = 0; i < points->count; ++i) {
        const double* xyz = points->now + 3 * i;
        fprintf(file, "%zu,%ld,", frame, points->id[i]);
        if (!is_known || points->found[i] == 0 || points->status[i] == DEFREC_POINT_UNKNOWN)
            fprintf(file, ",,,lost,\n");
        else
            fprintf(file, "%.4f,%.4f,%.4f,%s,%.4f\n", xyz[0], xyz[1], xyz[2],
                    points->status[i] == DEFREC_POINT_OBSERVED ? "tracked" : "extrapolated",
                    points->expected_error_mm[i]);
    }
}

int main(int argc, char** argv) {
    stereo_sequence sequence;
    tracking running;
    followed_points points;
    FILE* out;
    size_t i;
    int has_template = 0;
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
    fprintf(out, "frame,id,x,y,z,status,expected_error_mm\n");

    running = open_tracking(argv[3], &sequence.left, argc == 7 ? argv[6] : NULL, 0);

    for (i = 0; i < frame_count(&sequence); ++i) {
        defrec_result result;
        defrec_job job;
        read_frame(&sequence, i);
        job = track(&running, &sequence, timestamp_of(i), &result);

        /* The first frame that shows a surface gives the template. */
        if (!has_template && result.vertex_count > 0) {
            lift(&points, running.rig, running.tracker);
            has_template = 1;
        }
        if (has_template)
            check(defrec_job_warp_points(job, points.at_rest, points.count, points.now,
                                         points.status, points.expected_error_mm),
                  "warping the points");
        write_points(out, i, &points, has_template);
        defrec_job_release(job);
    }
    if (fclose(out) != 0) fail("%s: could not be written to its end", argv[5]);

    close_tracking(&running);
    free_points(&points);
    close_sequence(&sequence);
    return 0;
}
