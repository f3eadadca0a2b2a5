/* A single stage: the disparity of a rectified pair of images.
 *   stereo_only LEFT.png RIGHT.png OUT.pgm [DEVICE_ID]
 * OUT.pgm has 16 bits a pixel: disparity in 1/16 px, 0 where there is none. */
#include <stdio.h>
#include <stdlib.h>

#include "input.h"

static void write_pgm(const char* path, const int16_t* disparity, uint32_t width, uint32_t height) {
    const size_t count = (size_t)width * height;
    size_t i;
    FILE* file = fopen(path, "wb");
    if (file == NULL) fail("%s: cannot be written", path);
    fprintf(file, "P5\n%u %u\n65535\n", width, height);
    for (i = 0; i < count; ++i) {
        const int value = disparity[i] == DEFREC_DISPARITY_NONE ? 0 : disparity[i];
        fputc(value >> 8, file); /* the most significant byte first */
        fputc(value & 0xff, file);
    }
    if (fclose(file) != 0) fail("%s: could not be written to its end", path);
}

int main(int argc, char** argv) {
    image left = {0, 0, NULL}, right = {0, 0, NULL};
    defrec_context context;
    defrec_stage stereo;
    defrec_stereo_params params;
    defrec_const_buffer in[2];
    defrec_buffer out;
    size_t pixels;
    if (argc < 4 || argc > 5) {
        fprintf(stderr, "usage: stereo_only LEFT.png RIGHT.png OUT.pgm [DEVICE_ID]\n");
        return 2;
    }
    read_image(argv[1], DEFREC_FORMAT_GRAY8, &left);
    read_image(argv[2], DEFREC_FORMAT_GRAY8, &right);
    if (left.width != right.width || left.height != right.height)
        fail("%s: is not of the size of the left image", argv[2]);
    pixels = (size_t)left.width * left.height;

    check(defrec_context_create(NULL, &context), "loading the plugins");
    DEFREC_INIT(&params); /* 0 selects the default */
    params.width = left.width;
    params.height = left.height;
    check(defrec_stage_create(context, argc == 5 ? argv[4] : NULL, DEFREC_STAGE_STEREO, &params,
                              &stereo),
          "making the stage");

    /* docs/stages/stereo.md lists the buffers; those that are optional may be left out at the end.
     */
    in[0].data = left.pixels;
    in[1].data = right.pixels;
    in[0].size = in[1].size = pixels;
    out.size = pixels * sizeof(int16_t);
    out.data = malloc(out.size);
    if (out.data == NULL) fail("out of memory");
    check(defrec_stage_run(stereo, in, 2, &out, 1), "running the stage");
    write_pgm(argv[3], out.data, left.width, left.height);

    defrec_stage_destroy(stereo);
    defrec_context_destroy(context);
    free(out.data);
    free(left.pixels);
    free(right.pixels);
    return 0;
}
