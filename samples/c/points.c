#include "points.h"

#include <stdlib.h>

static void* allocate(size_t count, size_t size) {
    void* memory = calloc(count, size);
    if (memory == NULL) fail("out of memory");
    return memory;
}

followed_points read_points(const char* path) {
    enum { MOST = 1000000 };
    followed_points points;
    char line[256];
    FILE* file = fopen(path, "r");
    if (file == NULL || fgets(line, sizeof line, file) == NULL) fail("%s: cannot be read", path);
    points.count = 0;
    points.is_looked_up = 0;
    points.is_known = 0;
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

void free_points(followed_points* points) {
    free(points->id);
    free(points->uv);
    free(points->found);
    free(points->at_rest);
    free(points->now);
    free(points->status);
    free(points->expected_error_mm);
}

/* Lifts the pixels to the surface of the first frame. */
static void lift(followed_points* points, defrec_rig rig, defrec_job job) {
    defrec_template surface;
    check(defrec_rig_rectify_pixels(rig, points->uv, points->count, points->uv),
          "rectifying the points");
    check(defrec_job_get_template(job, &surface), "reading the template");
    wait_for_body(surface);
    check(defrec_template_lift(surface, points->uv, points->count, points->at_rest, points->found),
          "finding the surface under the points");
    defrec_template_release(surface);
}

void follow(followed_points* points, const tracking* running, defrec_job job,
            const defrec_result* result) {
    const int has_surface = result->vertex_count > 0;
    /* The pixels are of the first image: tissue is elsewhere in a later one. What was found on a
     * template that is given up says nothing of the next one. */
    if (!has_surface) points->is_known = 0;
    if (has_surface && !points->is_looked_up) {
        lift(points, running->rig, job);
        points->is_known = 1;
    }
    points->is_looked_up = 1;
    if (points->is_known)
        check(defrec_job_warp_points(job, points->at_rest, points->count, points->now,
                                     points->status, points->expected_error_mm),
              "warping the points");
}

void write_header(FILE* file) { fprintf(file, "frame,id,x,y,z,status,expected_error_mm\n"); }

void write_points(FILE* file, size_t frame, const followed_points* points) {
    size_t i;
    for (i = 0; i < points->count; ++i) {
        const double* xyz = points->now + 3 * i;
        fprintf(file, "%zu,%ld,", frame, points->id[i]);
        if (!points->is_known || points->found[i] == 0 || points->status[i] == DEFREC_POINT_UNKNOWN)
            fprintf(file, ",,,lost,\n");
        else
            fprintf(file, "%.4f,%.4f,%.4f,%s,%.4f\n", xyz[0], xyz[1], xyz[2],
                    points->status[i] == DEFREC_POINT_OBSERVED ? "tracked" : "extrapolated",
                    points->expected_error_mm[i]);
    }
}
