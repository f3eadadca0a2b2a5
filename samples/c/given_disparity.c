/* Disparity from outside: follows pixels of the first left image on the disparity of a stereo
 * network, a depth camera or another matcher, in place of defrec's own.
 *   given_disparity LEFT RIGHT FX,FY,CX,CY,BASELINE_MM DISPARITY SIGMA POINTS.csv OUT.csv
 * [DEVICE_ID] DISPARITY is a folder with a PFM file for each image, in the order of their names: px
 * of the rectified left image; 0, inf or NaN where there is none. SIGMA is the standard deviation
 * of the error that a pixel shares with those around it: a number of px for all of them, or a
 * folder of PFM files with that of each pixel. POINTS.csv has the columns id,u,v (px). OUT.csv has
 * the position of each point in each frame: mm, rectified left camera. */
#include <math.h>
#include <stdlib.h>

#include "points.h"

/* Where the disparity comes from. A live program has its network's output here. */
typedef struct {
    image_folder disparity_files, sigma_files; /* the latter is empty with sigma_px */
    float sigma_px;
    float *disparity, *sigma; /* of the frame that was read last */
    uint32_t width, height;
} disparity_source;

/* Values of the rectified image, rows from the top. What is not finite is 0. */
static void read_pfm(const char* path, float* values, uint32_t width, uint32_t height) {
    unsigned found_width = 0, found_height = 0;
    float scale = 0;
    uint32_t x, y;
    FILE* file = fopen(path, "rb");
    if (file == NULL) fail("%s: cannot be read", path);
    if (fscanf(file, "Pf %u %u %f", &found_width, &found_height, &scale) != 3 || scale == 0)
        fail("%s: a PFM of one channel expected", path);
    if (found_width != width || found_height != height)
        fail("%s: is %ux%u, the rectified image is %ux%u", path, found_width, found_height, width,
             height);
    fgetc(file);                 /* the blank behind the header */
    for (y = height; y-- > 0;) { /* the last row comes first */
        for (x = 0; x < width; ++x) {
            uint8_t bytes[4];
            const int first = scale < 0 ? 3 : 0, step = scale < 0 ? -1 : 1; /* little endian */
            uint32_t bits;
            float value;
            if (fread(bytes, 1, sizeof bytes, file) != sizeof bytes) fail("%s: is cut off", path);
            bits = (uint32_t)bytes[first] << 24 | (uint32_t)bytes[first + step] << 16 |
                   (uint32_t)bytes[first + 2 * step] << 8 | bytes[first + 3 * step];
            memcpy(&value, &bits, sizeof value);
            values[(size_t)y * width + x] = isfinite(value) ? value : 0;
        }
    }
    fclose(file);
}

static image_folder open_maps(const char* path, size_t frames) {
    image_folder maps = open_folder(path, ".pfm");
    const size_t count = maps.count;
    if (count == frames) return maps;
    close_folder(&maps);
    fail("%s has %zu PFM files, but there are %zu frames", path, count, frames);
}

static float* allocate_map(const disparity_source* source) {
    float* values = calloc((size_t)source->width * source->height, sizeof *values);
    if (values == NULL) fail("out of memory");
    return values;
}

static disparity_source open_disparity(const char* folder, const char* sigma, size_t frames,
                                       defrec_rig rig) {
    disparity_source source;
    defrec_rig_info info;
    char rest = 0;
    memset(&source, 0, sizeof source);
    DEFREC_INIT(&info);
    check(defrec_rig_get(rig, &info), "reading the rig");
    source.width = info.width;
    source.height = info.height;
    source.disparity_files = open_maps(folder, frames);
    source.disparity = allocate_map(&source);
    if (sscanf(sigma, "%f%c", &source.sigma_px, &rest) == 1) return source;
    source.sigma_px = 0;
    source.sigma_files = open_maps(sigma, frames);
    source.sigma = allocate_map(&source);
    return source;
}

static defrec_disparity read_disparity(disparity_source* source, size_t frame) {
    defrec_disparity given;
    DEFREC_INIT(&given);
    given.width = source->width;
    given.height = source->height;
    given.disparity = source->disparity;
    given.sigma = source->sigma; /* NULL: sigma_px at all pixels */
    given.sigma_px = source->sigma_px;
    read_pfm(source->disparity_files.paths[frame], source->disparity, given.width, given.height);
    if (source->sigma != NULL)
        read_pfm(source->sigma_files.paths[frame], source->sigma, given.width, given.height);
    return given;
}

static void close_disparity(disparity_source* source) {
    close_folder(&source->disparity_files);
    close_folder(&source->sigma_files);
    free(source->disparity);
    free(source->sigma);
}

/* The tracker copies the disparity like the pixels. The job must be released. */
static defrec_job track_with(const tracking* running, const stereo_sequence* sequence,
                             int64_t timestamp_ns, const defrec_disparity* disparity,
                             defrec_result* result) {
    const defrec_image left = view_of(&sequence->left, DEFREC_FORMAT_BGR8),
                       right = view_of(&sequence->right, DEFREC_FORMAT_BGR8);
    defrec_frame frame;
    defrec_job job;
    DEFREC_INIT(&frame);
    frame.timestamp_ns = timestamp_ns;
    frame.left = &left;
    frame.right = &right; /* stays required: the disparity is compared with both images */
    frame.disparity = disparity;
    check(defrec_tracker_submit(running->tracker, &frame, &job), "submitting a frame");
    check(defrec_job_wait(job, UINT64_MAX), "tracking a frame");
    DEFREC_INIT(result);
    check(defrec_job_result(job, result), "reading the result");
    return job;
}

int main(int argc, char** argv) {
    stereo_sequence sequence;
    tracking running;
    disparity_source source;
    followed_points points;
    FILE* out;
    size_t i, contradicted = 0;
    if (argc < 8 || argc > 9) {
        fprintf(stderr,
                "usage: given_disparity LEFT RIGHT FX,FY,CX,CY,BASELINE_MM DISPARITY SIGMA "
                "POINTS.csv OUT.csv [DEVICE_ID]\n");
        return 2;
    }
    sequence = open_sequence(argv[1], argv[2]);
    points = read_points(argv[6]);
    running = open_tracking(argv[3], &sequence.left, argc == 9 ? argv[8] : NULL, 0);
    source = open_disparity(argv[4], argv[5], frame_count(&sequence), running.rig);
    out = fopen(argv[7], "w");
    if (out == NULL) fail("%s: cannot be written", argv[7]);
    write_header(out);

    for (i = 0; i < frame_count(&sequence); ++i) {
        defrec_result result;
        defrec_job job;
        const defrec_disparity disparity = read_disparity(&source, i);
        read_frame(&sequence, i);
        job = track_with(&running, &sequence, timestamp_of(i), &disparity, &result);
        /* Another unit, another frame or another rectification: do not go on unnoticed. */
        if ((result.reasons & DEFREC_REASON_DISPARITY) != 0) ++contradicted;
        follow(&points, &running, job, &result);
        write_points(out, i, &points);
        defrec_job_release(job);
    }
    if (fclose(out) != 0) fail("%s: could not be written to its end", argv[7]);
    printf("%zu frames, in %zu of them the images contradict the disparity\n",
           frame_count(&sequence), contradicted);

    close_disparity(&source);
    close_tracking(&running);
    free_points(&points);
    close_sequence(&sequence);
    return 0;
}
