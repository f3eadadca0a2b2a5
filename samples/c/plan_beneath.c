/* A plan beneath the surface: follows its targets (a tumour's margin, a vessel) through a stereo
 * sequence, and draws them over the left image with a ring of the expected error.
 *   plan_beneath LEFT RIGHT FX,FY,CX,CY,BASELINE_MM TARGETS.csv OUT_FOLDER [DEVICE_ID]
 * TARGETS.csv has the columns id,x,y,z, and may have others: mm, template frame (the rectified left
 * camera of the frame that became the template; an application registers its plan to that).
 * OUT_FOLDER/targets.csv has the position of each target in each frame: mm, rectified left camera.
 * OUT_FOLDER/000000.ppm and so on are the left images with the targets: a dot where each is, and a
 * ring as wide as the error to be expected there, of at least 3 px. Green ones lie on the surface
 * and were observed; those that the tissue carries are orange. */
#define _POSIX_C_SOURCE 200809L
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#ifdef _WIN32
#include <direct.h>
#define mkdir(path, mode) _mkdir(path)
#endif

#include "tracking.h"

enum { MOST_TARGETS = 1000000, MOST_COLUMNS = 64 };

typedef struct {
    size_t count;
    long* id;
    double* at_rest; /* xyz, template frame */
    double* now;     /* xyz, rectified left camera of the frame */
    uint8_t* status;
    double* expected_error_mm;
} plan;

static void* allocate(size_t count, size_t size) {
    void* memory = calloc(count, size);
    if (memory == NULL) fail("out of memory");
    return memory;
}

/* Parts the line at its commas; returns the number of cells. */
static size_t split(char* line, char** cells) {
    size_t count = 0;
    line[strcspn(line, "\r\n")] = '\0';
    while (count < MOST_COLUMNS) {
        const size_t length = strcspn(line, ",");
        cells[count++] = line;
        if (line[length] == '\0') break;
        line[length] = '\0';
        line += length + 1;
    }
    return count;
}

static double number_of(const char* path, const char* cell) {
    char* end;
    const double value = strtod(cell, &end);
    if (end == cell || *end != '\0') fail("%s: \"%s\" is no number", path, cell);
    return value;
}

static plan read_plan(const char* path) {
    static const char* const names[] = {"id", "x", "y", "z"};
    plan read;
    char line[1024];
    char* cells[MOST_COLUMNS];
    size_t columns[4], count, i, k;
    FILE* file = fopen(path, "r");
    if (file == NULL || fgets(line, sizeof line, file) == NULL) fail("%s: cannot be read", path);
    count = split(line, cells);
    for (i = 0; i < 4; ++i) {
        for (k = 0; k < count && strcmp(cells[k], names[i]) != 0; ++k) continue;
        if (k == count) fail("%s: the columns id,x,y,z expected", path);
        columns[i] = k;
    }
    read.count = 0;
    while (fgets(line, sizeof line, file) != NULL) ++read.count;
    if (read.count == 0 || read.count > MOST_TARGETS)
        fail("%s: 1 to %d targets expected", path, MOST_TARGETS);
    read.id = allocate(read.count, sizeof *read.id);
    read.at_rest = allocate(read.count, 3 * sizeof *read.at_rest);
    read.now = allocate(read.count, 3 * sizeof *read.now);
    read.status = allocate(read.count, 1);
    read.expected_error_mm = allocate(read.count, sizeof *read.expected_error_mm);
    rewind(file);
    fgets(line, sizeof line, file); /* the header */
    for (i = 0; i < read.count && fgets(line, sizeof line, file) != NULL; ++i) {
        const size_t found = split(line, cells);
        for (k = 0; k < 4; ++k)
            if (columns[k] >= found) fail("%s: line %zu has %zu cells", path, i + 2, found);
        read.id[i] = (long)number_of(path, cells[columns[0]]);
        for (k = 0; k < 3; ++k) read.at_rest[3 * i + k] = number_of(path, cells[columns[k + 1]]);
    }
    fclose(file);
    return read;
}

static void free_plan(plan* read) {
    free(read->id);
    free(read->at_rest);
    free(read->now);
    free(read->status);
    free(read->expected_error_mm);
}

/* Prepares the targets, once there is a template. */
static defrec_targets prepare(const plan* targets, defrec_job job) {
    defrec_template surface;
    defrec_targets prepared;
    check(defrec_job_get_template(job, &surface), "reading the template");
    wait_for_body(surface);
    check(defrec_targets_create(surface, targets->at_rest, targets->count, &prepared),
          "preparing the targets");
    defrec_template_release(surface); /* the targets keep what they need */
    return prepared;
}

static void write_rows(FILE* file, size_t frame, const plan* targets) {
    size_t i;
    for (i = 0; i < targets->count; ++i) {
        const double* xyz = targets->now + 3 * i;
        fprintf(file, "%zu,%ld,", frame, targets->id[i]);
        if (targets->status[i] == DEFREC_POINT_UNKNOWN)
            fprintf(file, ",,,lost,\n");
        else
            fprintf(file, "%.4f,%.4f,%.4f,%s,%.4f\n", xyz[0], xyz[1], xyz[2],
                    targets->status[i] == DEFREC_POINT_OBSERVED ? "tracked" : "extrapolated",
                    targets->expected_error_mm[i]);
    }
}

static long sixteenths(double px) { return (long)(16 * px + 0.5); }
static long at_least(long a, long b) { return a > b ? a : b; }
static long at_most(long a, long b) { return a < b ? a : b; }

/* A dot and a ring; centre and radius in 1/16 px. */
static void draw_target(image* picture, long u, long v, long radius, const uint8_t bgr[3]) {
    const long dot = 24, half_line = 12, reach = at_least(radius + half_line, dot) / 16 + 1;
    const long right = at_most(u / 16 + reach, (long)picture->width - 1);
    const long bottom = at_most(v / 16 + reach, (long)picture->height - 1);
    long x, y;
    for (y = at_least(v / 16 - reach, 0); y <= bottom; ++y)
        for (x = at_least(u / 16 - reach, 0); x <= right; ++x) {
            const long dx = 16 * x - u, dy = 16 * y - v, squared = dx * dx + dy * dy;
            const long inner = radius - half_line, outer = radius + half_line;
            if (squared <= dot * dot || (squared >= inner * inner && squared <= outer * outer))
                memcpy(picture->pixels + 3 * ((size_t)y * picture->width + (size_t)x), bgr, 3);
        }
}

static void draw(image* picture, const plan* targets, const defrec_camera* camera) {
    static const uint8_t observed[3] = {96, 220, 64}, carried[3] = {32, 176, 255};
    size_t i;
    for (i = 0; i < targets->count; ++i) {
        const double *xyz = targets->now + 3 * i, error = targets->expected_error_mm[i];
        double u, v, radius;
        if (targets->status[i] == DEFREC_POINT_UNKNOWN || !(xyz[2] > 0)) continue;
        u = camera->fx * xyz[0] / xyz[2] + camera->cx;
        v = camera->fy * xyz[1] / xyz[2] + camera->cy;
        radius = camera->fx * error / xyz[2];
        if (!(u >= 0 && u < picture->width && v >= 0 && v < picture->height && radius < 8192))
            continue;
        draw_target(picture, sixteenths(u), sixteenths(v), at_least(sixteenths(radius), 3 * 16),
                    targets->status[i] == DEFREC_POINT_OBSERVED ? observed : carried);
    }
}

static void write_ppm(const char* folder, size_t frame, const image* picture) {
    const size_t count = (size_t)picture->width * picture->height;
    char path[4096];
    size_t i;
    FILE* file;
    snprintf(path, sizeof path, "%s/%06zu.ppm", folder, frame);
    file = fopen(path, "wb");
    if (file == NULL) fail("%s: cannot be written", path);
    fprintf(file, "P6\n%u %u\n255\n", picture->width, picture->height);
    for (i = 0; i < count; ++i) {
        const uint8_t* bgr = picture->pixels + 3 * i;
        fputc(bgr[2], file);
        fputc(bgr[1], file);
        fputc(bgr[0], file);
    }
    if (fclose(file) != 0) fail("%s: could not be written to its end", path);
}

static void print_frame(size_t frame, const plan* targets, uint32_t body) {
    size_t i, known = 0;
    double most = 0;
    for (i = 0; i < targets->count; ++i) {
        if (targets->status[i] == DEFREC_POINT_UNKNOWN) continue;
        ++known;
        if (targets->expected_error_mm[i] > most) most = targets->expected_error_mm[i];
    }
    printf("frame %zu: body %s, %zu of %zu targets, expected error up to %.4f mm\n", frame,
           body == DEFREC_BODY_STATE_READY     ? "ready"
           : body == DEFREC_BODY_STATE_PENDING ? "pending"
                                               : "none",
           known, targets->count, most);
}

int main(int argc, char** argv) {
    stereo_sequence sequence;
    plan targets;
    tracking running;
    defrec_targets prepared = NULL;
    char path[4096];
    FILE* out;
    int is_void = 0; /* the template of the targets was given up */
    size_t i;
    if (argc < 6 || argc > 7) {
        fprintf(stderr,
                "usage: plan_beneath LEFT RIGHT FX,FY,CX,CY,BASELINE_MM TARGETS.csv OUT_FOLDER "
                "[DEVICE_ID]\n");
        return 2;
    }
    sequence = open_sequence(argv[1], argv[2]);
    targets = read_plan(argv[4]);
    if (mkdir(argv[5], 0777) != 0 && errno != EEXIST) fail("%s: cannot be made", argv[5]);
    snprintf(path, sizeof path, "%s/targets.csv", argv[5]);
    out = fopen(path, "w");
    if (out == NULL) fail("%s: cannot be written", path);
    fprintf(out, "frame,id,x,y,z,status,expected_error_mm\n");

    running = open_tracking(argv[3], &sequence.left, argc == 7 ? argv[6] : NULL, 0);

    for (i = 0; i < frame_count(&sequence); ++i) {
        defrec_result result;
        defrec_job job;
        read_frame(&sequence, i);
        job = track(&running, &sequence, timestamp_of(i), &result);
        if (prepared == NULL && result.vertex_count > 0) { /* there is a template */
            prepared = prepare(&targets, job);
            check(defrec_job_result(job, &result), "reading the result");
        }
        if (prepared != NULL && !is_void) is_void = is_given_up(&result, i);
        memset(targets.status, DEFREC_POINT_UNKNOWN, targets.count);
        if (prepared != NULL && !is_void)
            check(defrec_job_move_targets(job, prepared, targets.count, targets.now, NULL,
                                          targets.status, targets.expected_error_mm),
                  "moving the targets");
        defrec_job_release(job);
        write_rows(out, i, &targets);
        draw(&sequence.left, &targets, &running.camera); /* the tracker has its own copy */
        write_ppm(argv[5], i, &sequence.left);
        print_frame(i, &targets, result.body);
    }
    if (fclose(out) != 0) fail("%s: could not be written to its end", path);

    defrec_targets_destroy(prepared);
    close_tracking(&running);
    free_plan(&targets);
    close_sequence(&sequence);
    return 0;
}
