/* The stage stereo on the CPU device, on a pair of images whose every pixel is shifted by the same
 * amount. */
#include <defrec_c.h>
#include <stdio.h>
#include <stdlib.h>

enum { WIDTH = 160, HEIGHT = 120, SHIFT = 12 };

static int fail(const char* what) {
    fprintf(stderr, "%s: %s\n", what, defrec_last_error());
    return 1;
}

static int has_cpu_device(defrec_context context) {
    const size_t count = defrec_device_count(context);
    for (size_t i = 0; i < count; ++i) {
        defrec_device_info info;
        DEFREC_INIT(&info);
        if (defrec_device_get(context, i, &info) == DEFREC_OK && strcmp(info.id, "cpu") == 0)
            return 1;
    }
    return 0;
}

int main(void) {
    static uint8_t left[WIDTH * HEIGHT], right[WIDTH * HEIGHT];
    static int16_t disparity[WIDTH * HEIGHT];
    for (int y = 0; y < HEIGHT; ++y) {
        uint8_t texture[WIDTH + SHIFT];
        for (int x = 0; x < WIDTH + SHIFT; ++x) texture[x] = (uint8_t)(rand() % 200);
        memcpy(left + y * WIDTH, texture, WIDTH);
        memcpy(right + y * WIDTH, texture + SHIFT, WIDTH);
    }

    defrec_context context;
    if (defrec_context_create(NULL, &context) < 0) return fail("context");
    if (!has_cpu_device(context)) {
        fprintf(stderr, "no CPU device\n");
        return 1;
    }
    defrec_stereo_params params;
    DEFREC_INIT(&params);
    params.width = WIDTH;
    params.height = HEIGHT;
    params.disparities = 32;
    defrec_stage stereo;
    if (defrec_stage_create(context, "cpu", DEFREC_STAGE_STEREO, &params, &stereo) < 0)
        return fail("stage");
    const defrec_const_buffer in[] = {{left, sizeof left}, {right, sizeof right}};
    const defrec_buffer out[] = {{disparity, sizeof disparity}};
    if (defrec_stage_run(stereo, in, 2, out, 1) < 0) return fail("run");
    defrec_stage_destroy(stereo);
    defrec_context_destroy(context);

    int right_ones = 0, wrong_ones = 0;
    for (int i = 0; i < WIDTH * HEIGHT; ++i) {
        if (disparity[i] == DEFREC_DISPARITY_NONE) continue;
        if (abs(disparity[i] - SHIFT * DEFREC_DISPARITY_ONE) <= 2)
            ++right_ones;
        else
            ++wrong_ones;
    }
    printf("defrec %s: %d pixels right, %d wrong\n", defrec_version_string(), right_ones,
           wrong_ones);
    return right_ones > WIDTH * HEIGHT / 2 && wrong_ones < right_ones / 100 ? 0 : 1;
}
