/* From the scan to the tissue: registers a preoperative model to the template, once, and follows
 * its targets through a stereo sequence.
 *   scan_to_tissue LEFT RIGHT FX,FY,CX,CY,BASELINE_MM SCAN.obj LANDMARKS.csv TARGETS.csv OUT.csv
 *       [DEVICE_ID]
 * SCAN.obj is the organ's surface as the scan has it (CT, say), mm. LANDMARKS.csv has the columns
 * x,y,z,u,v: three or more places of the scan, and the pixels of the first left image where
 * somebody saw them, which therefore has to show the surface. TARGETS.csv has the columns id,x,y,z,
 * in the scan's frame. OUT.csv has their positions in each frame, rectified left camera, with the
 * error to be expected: that of the registration and that of tracking together. A registration that
 * cannot be trusted ends the program, with the reason; a person has to look. */
#include <stdio.h>
#include <stdlib.h>

#include "mesh.h"
#include "tracking.h"

enum { MOST_ROWS = 100000, LANDMARK_COLUMNS = 5, TARGET_COLUMNS = 4 };

/* Rows of numbers, below a header. */
typedef struct {
    size_t count;
    double* values;
} table;

static table read_table(const char* path, const char* header, size_t columns) {
    table read = {0, NULL};
    char line[512];
    FILE* file = fopen(path, "r");
    if (file == NULL || fgets(line, sizeof line, file) == NULL) fail("%s: cannot be read", path);
    line[strcspn(line, "\r\n")] = '\0';
    if (strcmp(line, header) != 0) fail("%s: the header is %s, %s expected", path, line, header);
    read.values = allocate(MOST_ROWS * columns, sizeof *read.values);
    while (fgets(line, sizeof line, file) != NULL) {
        char *cell = line, *end;
        size_t k;
        if (read.count == MOST_ROWS) fail("%s: at most %d rows expected", path, MOST_ROWS);
        for (k = 0; k < columns; ++k) {
            read.values[read.count * columns + k] = strtod(cell, &end);
            if (end == cell || (k + 1 < columns && *end != ','))
                fail("%s: line %zu: %zu numbers expected", path, read.count + 2, columns);
            cell = end + 1;
        }
        ++read.count;
    }
    fclose(file);
    return read;
}

static defrec_registration_info info_of(defrec_registration registration) {
    defrec_registration_info info;
    DEFREC_INIT(&info);
    check(defrec_registration_get(registration, &info), "reading the registration");
    return info;
}

/* About where the scan lies, by its landmarks: they are clicked, so they are not exact. */
static void start_by_landmarks(const tracking* running, defrec_template surface, const char* path,
                               double transform[12]) {
    const double error_mm = 1;
    const table landmarks = read_table(path, "x,y,z,u,v", LANDMARK_COLUMNS);
    double* scan = allocate(landmarks.count + 1, 3 * sizeof *scan);
    double* seen = allocate(landmarks.count + 1, 3 * sizeof *seen);
    double* covariance = allocate(landmarks.count + 1, 6 * sizeof *covariance);
    size_t i, used = 0;
    defrec_registration_pairs pairs;
    defrec_registration registration;
    defrec_registration_info info;
    for (i = 0; i < landmarks.count; ++i) {
        const double* row = landmarks.values + LANDMARK_COLUMNS * i;
        double *errors = covariance + 6 * used, uv[2];
        uint8_t found;
        check(defrec_rig_rectify_pixels(running->rig, row + 3, 1, uv), "rectifying a landmark");
        check(defrec_template_lift(surface, uv, 1, seen + 3 * used, &found), "finding a landmark");
        if (!found) continue; /* the template has no surface there */
        memcpy(scan + 3 * used, row, 3 * sizeof *row);
        errors[0] = errors[3] = errors[5] = error_mm * error_mm;
        ++used;
    }
    if (used < 3) fail("%zu landmarks lie on the template, three or more expected", used);
    DEFREC_INIT(&pairs);
    pairs.model_xyz = scan;
    pairs.seen_xyz = seen;
    pairs.seen_covariance = covariance;
    pairs.count = used;
    check(defrec_registration_from_pairs(&pairs, &registration), "registering the landmarks");
    info = info_of(registration);
    printf("landmarks: %s\n", info.reason);
    if (info.verdict != DEFREC_VERDICT_ACCEPTED && info.verdict != DEFREC_VERDICT_UNDETERMINED)
        fail("the landmarks give no start: %s", info.reason);
    memcpy(transform, info.transform, sizeof info.transform);
    defrec_registration_destroy(registration);
    free(scan);
    free(seen);
    free(covariance);
    free(landmarks.values);
}

/* Then by the surface, which says much more. */
static defrec_registration register_scan(const tracking* running, defrec_template surface,
                                         const mesh* scan, const double start[12]) {
    float* vertices = allocate(scan->vertex_count, 3 * sizeof *vertices);
    size_t i;
    defrec_registration_desc desc;
    defrec_registration registration;
    defrec_registration_info info;
    for (i = 0; i < 3 * scan->vertex_count; ++i) vertices[i] = (float)scan->vertices[i];
    DEFREC_INIT(&desc);
    desc.model_vertices = vertices;
    desc.model_vertex_count = scan->vertex_count;
    desc.model_triangles = scan->triangles;
    desc.model_triangle_count = scan->triangle_count;
    desc.max_shift_mm = 10; /* the landmarks are not farther off */
    desc.max_turn_rad = 0.2;
    memcpy(desc.start, start, sizeof desc.start);
    check(defrec_registration_from_template(running->context, surface, &desc, &registration),
          "registering the scan");
    free(vertices);
    info = info_of(registration);
    printf("surface: %s\n", info.reason);
    for (i = 0; i < info.free_motion_count; ++i) {
        defrec_free_motion motion;
        DEFREC_INIT(&motion);
        check(defrec_registration_get_free_motion(registration, i, &motion), "reading a motion");
        printf("not determined: %s\n", motion.text);
    }
    if (info.verdict != DEFREC_VERDICT_ACCEPTED)
        fail("the scan is not registered: %s", info.reason);
    return registration;
}

/* The scan's targets, registered, and what becomes of them. */
typedef struct {
    table scan; /* id, then xyz */
    defrec_plan plan;
    double *now, *expected_error_mm; /* rectified left camera */
    uint8_t* status;
} followed;

static followed follow(const char* path, const tracking* running, const mesh* scan,
                       const char* landmarks, defrec_job job) {
    followed made;
    defrec_template surface;
    defrec_registration registration;
    defrec_plan_desc desc;
    double start[12], *xyz;
    size_t i;
    made.scan = read_table(path, "id,x,y,z", TARGET_COLUMNS);
    made.now = allocate(made.scan.count + 1, 3 * sizeof *made.now);
    made.expected_error_mm = allocate(made.scan.count + 1, sizeof(double));
    made.status = allocate(made.scan.count + 1, 1);
    check(defrec_job_get_template(job, &surface), "reading the template");
    start_by_landmarks(running, surface, landmarks, start);
    registration = register_scan(running, surface, scan, start);
    xyz = allocate(made.scan.count + 1, 3 * sizeof *xyz);
    for (i = 0; i < made.scan.count; ++i)
        memcpy(xyz + 3 * i, made.scan.values + TARGET_COLUMNS * i + 1, 3 * sizeof *xyz);
    DEFREC_INIT(&desc);
    desc.targets = xyz;
    desc.target_count = made.scan.count;
    check(defrec_plan_create(surface, registration, &desc, &made.plan), "making the plan");
    wait_for_body(surface);
    free(xyz);
    defrec_registration_destroy(registration);
    defrec_template_release(surface);
    return made;
}

static void write_frame(FILE* out, size_t frame, const followed* targets) {
    size_t i;
    for (i = 0; i < targets->scan.count; ++i) {
        const double* xyz = targets->now + 3 * i;
        fprintf(out, "%zu,%.0f,", frame, targets->scan.values[TARGET_COLUMNS * i]);
        if (targets->status[i] == DEFREC_POINT_UNKNOWN)
            fprintf(out, ",,,lost,\n");
        else
            fprintf(out, "%.4f,%.4f,%.4f,%s,%.4f\n", xyz[0], xyz[1], xyz[2],
                    targets->status[i] == DEFREC_POINT_OBSERVED ? "tracked" : "extrapolated",
                    targets->expected_error_mm[i]);
    }
}

static void free_followed(followed* targets) {
    defrec_plan_destroy(targets->plan);
    free(targets->scan.values);
    free(targets->now);
    free(targets->expected_error_mm);
    free(targets->status);
}

int main(int argc, char** argv) {
    stereo_sequence sequence;
    tracking running;
    mesh scan;
    followed targets;
    int is_void = 0; /* the template of the plan was given up */
    FILE* out;
    size_t i;
    if (argc < 8 || argc > 9) {
        fprintf(stderr,
                "usage: scan_to_tissue LEFT RIGHT FX,FY,CX,CY,BASELINE_MM SCAN.obj LANDMARKS.csv "
                "TARGETS.csv OUT.csv [DEVICE_ID]\n");
        return 2;
    }
    sequence = open_sequence(argv[1], argv[2]);
    scan = read_obj(argv[4]);
    out = fopen(argv[7], "w");
    if (out == NULL) fail("%s: cannot be written", argv[7]);
    fprintf(out, "frame,id,x,y,z,status,expected_error_mm\n");
    running = open_tracking(argv[3], &sequence.left, argc == 9 ? argv[8] : NULL, 0);

    for (i = 0; i < frame_count(&sequence); ++i) {
        defrec_result result;
        defrec_job job;
        read_frame(&sequence, i);
        job = track(&running, &sequence, timestamp_of(i), &result);
        if (i == 0) {
            /* The landmarks are its pixels: tissue is elsewhere in a later image. */
            if (result.vertex_count == 0)
                fail(
                    "the landmarks are pixels of the first image, which shows no surface; begin "
                    "where one is seen");
            targets = follow(argv[6], &running, &scan, argv[5], job);
        }
        if (!is_void) is_void = is_given_up(&result, i);
        if (is_void)
            memset(targets.status, DEFREC_POINT_UNKNOWN, targets.scan.count);
        else
            check(defrec_job_move_plan(job, targets.plan, targets.scan.count, targets.now, NULL,
                                       targets.status, targets.expected_error_mm),
                  "moving the plan");
        write_frame(out, i, &targets);
        defrec_job_release(job);
    }
    if (fclose(out) != 0) fail("%s: could not be written to its end", argv[7]);

    free_followed(&targets);
    close_tracking(&running);
    free(scan.vertices);
    free(scan.triangles);
    close_sequence(&sequence);
    return 0;
}
