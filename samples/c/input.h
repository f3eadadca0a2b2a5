/* Input of the samples: a camera on the command line, folders of PNG images. */
#ifndef DEFREC_SAMPLES_INPUT_H
#define DEFREC_SAMPLES_INPUT_H
#include <defrec_c.h>
#include <stdint.h>

/* Ends the program with defrec's error message if the call failed. */
void check(defrec_status status, const char* doing);
/* Ends the program: format as printf's. */
#if defined(__MINGW32__)
__attribute__((format(gnu_printf, 1, 2), noreturn))
#elif defined(__GNUC__)
__attribute__((format(printf, 1, 2), noreturn))
#endif
void fail(const char *format, ...);

/* "FX,FY,CX,CY,BASELINE_MM" of a rectified pair of images of this size. */
defrec_rig_desc parse_camera(const char* text, uint32_t width, uint32_t height);

typedef struct {
    char** paths; /* of the files in a folder with that ending, in the order of their names */
    size_t count;
} image_folder;
image_folder open_folder(const char* path, const char* ending); /* ".png" */
void close_folder(image_folder* folder);

typedef struct {
    uint32_t width, height;
    uint8_t* pixels; /* rows from the top without gaps, malloc'ed; kept for the next image of the
                        same size */
} image;
/* format: DEFREC_FORMAT_BGR8 or DEFREC_FORMAT_GRAY8. image starts as zeros. */
void read_image(const char* path, uint32_t format, image* out);
/* The image in the form that the tracker and the stages take. */
defrec_image view_of(const image* source, uint32_t format);

/* Two folders, frame by frame. */
typedef struct {
    image_folder left_files, right_files;
    image left, right; /* BGR */
} stereo_sequence;
stereo_sequence open_sequence(const char* left_folder,
                              const char* right_folder); /* with its first frame read */
size_t frame_count(const stereo_sequence* sequence);
void read_frame(stereo_sequence* sequence, size_t index);
void close_sequence(stereo_sequence* sequence);

/* At 30 frames a second. */
int64_t timestamp_of(size_t frame);
#endif
