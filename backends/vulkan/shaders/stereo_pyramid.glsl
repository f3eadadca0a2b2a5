// Stage stereo, section 6: the field and its coarser ones, one after the other in one buffer.
// Without any disparity all of them stay as they are: the mean of DEFREC_DISPARITY_NONE is itself.
#include "backends/stages/stereo.hpp"
#include "stereo_push.h"
layout(std430, set = 0, binding = 0) coherent buffer Pyramid { int16_t pyramid[]; };
layout(push_constant) uniform Push { PyramidLevel push; };

struct Level {
    int width, height, offset;
};

Level level_at(int index) {
    Level level = Level(push.width, push.height, 0);
    for (int i = 0; i < index; ++i)
        level = Level((level.width + 1) / 2, (level.height + 1) / 2,
                      level.offset + level.width * level.height);
    return level;
}

int value(Level level, int x, int y) {
    return int(pyramid[level.offset + clamp(y, 0, level.height - 1) * level.width +
                       clamp(x, 0, level.width - 1)]);
}

void make_coarser(Level fine, Level coarse, int x, int y) {
    int sum = 0, n = 0;
    for (int k = 0; k < 4; ++k) {
        const int u = 2 * x + (k & 1), v = 2 * y + (k >> 1);
        const int disparity = u < fine.width && v < fine.height ? value(fine, u, v) : kNoDisparity;
        if (disparity == kNoDisparity) continue;
        sum += disparity;
        ++n;
    }
    // Disparities are not negative.
    pyramid[coarse.offset + y * coarse.width + x] =
        int16_t(n == 0 ? kNoDisparity : (2 * sum + n) / (2 * n));
}

void fill_hole(Level fine, Level coarse, int x, int y) {
    const int i = fine.offset + y * fine.width + x;
    if (int(pyramid[i]) != kNoDisparity) return;
    const int u = x >> 1, v = y >> 1, u2 = (x & 1) == 0 ? u - 1 : u + 1,
              v2 = (y & 1) == 0 ? v - 1 : v + 1;
    const int sum = 9 * value(coarse, u, v) + 3 * value(coarse, u2, v) + 3 * value(coarse, u, v2) +
                    value(coarse, u2, v2);
    pyramid[i] = int16_t((sum + 8) >> 4);
}
