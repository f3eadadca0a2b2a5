#define _POSIX_C_SOURCE 200809L
#include "input.h"

#include <dirent.h>
#include <png.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

void check(defrec_status status, const char* doing) {
    if (status < 0) fail("%s: %s (%s)", doing, defrec_last_error(), defrec_status_name(status));
}

void fail(const char* format, ...) {
    va_list values;
    va_start(values, format);
    vfprintf(stderr, format, values);
    va_end(values);
    fputc('\n', stderr);
    exit(1);
}

defrec_rig_desc parse_camera(const char* text, uint32_t width, uint32_t height) {
    defrec_rig_desc rig;
    defrec_intrinsics* camera = &rig.left;
    double baseline_mm = 0;
    char rest = 0;
    DEFREC_INIT(&rig);
    if (sscanf(text, "%lf,%lf,%lf,%lf,%lf%c", &camera->fx, &camera->fy, &camera->cx, &camera->cy,
               &baseline_mm, &rest) != 5)
        fail("the camera is \"%s\"; FX,FY,CX,CY,BASELINE_MM expected", text);
    rig.width = width;
    rig.height = height;
    rig.right = rig.left;
    rig.rotation[0] = rig.rotation[4] = rig.rotation[8] = 1;
    rig.translation[0] = -baseline_mm; /* the right camera stands on the right */
    return rig;
}

static int ends_with(const char* name, const char* ending) {
    const size_t length = strlen(name), end = strlen(ending);
    return length > end && strcmp(name + length - end, ending) == 0;
}

static int by_name(const void* a, const void* b) {
    return strcmp(*(char* const*)a, *(char* const*)b);
}

image_folder open_folder(const char* path, const char* ending) {
    image_folder folder = {NULL, 0};
    size_t room = 0;
    const struct dirent* entry;
    DIR* entries = opendir(path);
    if (entries == NULL) fail("%s: cannot be read as a folder", path);
    while ((entry = readdir(entries)) != NULL) {
        const size_t size = strlen(path) + strlen(entry->d_name) + 2;
        if (!ends_with(entry->d_name, ending)) continue;
        if (folder.count == room) {
            room = 2 * room + 64;
            folder.paths = realloc(folder.paths, room * sizeof *folder.paths);
            if (folder.paths == NULL) fail("out of memory");
        }
        folder.paths[folder.count] = malloc(size);
        if (folder.paths[folder.count] == NULL) fail("out of memory");
        snprintf(folder.paths[folder.count++], size, "%s/%s", path, entry->d_name);
    }
    closedir(entries);
    if (folder.count == 0) fail("%s: no file *%s in it", path, ending);
    qsort(folder.paths, folder.count, sizeof *folder.paths, by_name);
    return folder;
}

void close_folder(image_folder* folder) {
    size_t i;
    for (i = 0; i < folder->count; ++i) free(folder->paths[i]);
    free(folder->paths);
}

void read_image(const char* path, uint32_t format, image* out) {
    png_image png;
    memset(&png, 0, sizeof png);
    png.version = PNG_IMAGE_VERSION;
    if (png_image_begin_read_from_file(&png, path) == 0) fail("%s: %s", path, png.message);
    png.format = format == DEFREC_FORMAT_GRAY8 ? PNG_FORMAT_GRAY : PNG_FORMAT_BGR;
    if (out->pixels == NULL) {
        out->width = png.width;
        out->height = png.height;
        out->pixels = malloc(PNG_IMAGE_SIZE(png));
        if (out->pixels == NULL) fail("out of memory");
    } else if (out->width != png.width || out->height != png.height) {
        fail("%s: is %ux%u, the images before it were %ux%u", path, png.width, png.height,
             out->width, out->height);
    }
    if (png_image_finish_read(&png, NULL, out->pixels, 0, NULL) == 0)
        fail("%s: %s", path, png.message);
}

defrec_image view_of(const image* source, uint32_t format) {
    defrec_image view;
    DEFREC_INIT(&view);
    view.format = format;
    view.width = source->width;
    view.height = source->height;
    view.pixels = source->pixels;
    return view;
}

stereo_sequence open_sequence(const char* left_folder, const char* right_folder) {
    stereo_sequence sequence;
    memset(&sequence, 0, sizeof sequence);
    sequence.left_files = open_folder(left_folder, ".png");
    sequence.right_files = open_folder(right_folder, ".png");
    if (sequence.left_files.count != sequence.right_files.count)
        fail("%s has %zu images, %s has %zu", left_folder, sequence.left_files.count, right_folder,
             sequence.right_files.count);
    read_frame(&sequence, 0);
    if (sequence.left.width != sequence.right.width ||
        sequence.left.height != sequence.right.height)
        fail("%s: is not of the size of the left image", sequence.right_files.paths[0]);
    return sequence;
}

size_t frame_count(const stereo_sequence* sequence) { return sequence->left_files.count; }

void read_frame(stereo_sequence* sequence, size_t index) {
    read_image(sequence->left_files.paths[index], DEFREC_FORMAT_BGR8, &sequence->left);
    read_image(sequence->right_files.paths[index], DEFREC_FORMAT_BGR8, &sequence->right);
}

void close_sequence(stereo_sequence* sequence) {
    close_folder(&sequence->left_files);
    close_folder(&sequence->right_files);
    free(sequence->left.pixels);
    free(sequence->right.pixels);
}

int64_t timestamp_of(size_t frame) { return (int64_t)frame * 1000000000 / 30; }
