// Stage stereo, section 6: the field and its coarser ones, one after the other in one buffer.
// Without any disparity all of them stay as they are: the mean of DEFREC_DISPARITY_NONE is itself.
#include "backends/stages/stereo.hpp"
#include "stereo_push.h"
layout(std430, set = 0, binding = 0) buffer Pyramid { int16_t pyramid[]; };
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

// Of four pixels, of which some are missing. Disparities are not negative.
int mean_of(int a, int b, int c, int d) {
    const ivec4 four = ivec4(a, b, c, d);
    int sum = 0, n = 0;
    for (int k = 0; k < 4; ++k) {
        sum += four[k] == kNoDisparity ? 0 : four[k];
        n += four[k] == kNoDisparity ? 0 : 1;
    }
    return n == 0 ? kNoDisparity : (2 * sum + n) / (2 * n);
}

// A pixel of the field that is coarser than `fine`.
int coarser_value(Level fine, int x, int y) {
    const int u = 2 * x, v = 2 * y;
    const bool right = u + 1 < fine.width, below = v + 1 < fine.height;
    return mean_of(value(fine, u, v), right ? value(fine, u + 1, v) : kNoDisparity,
                   below ? value(fine, u, v + 1) : kNoDisparity,
                   right && below ? value(fine, u + 1, v + 1) : kNoDisparity);
}

// A hole from the pixel of the coarser field that it lies in and that one's nearest neighbours.
int filled(int near, int beside, int above, int across) {
    return (9 * near + 3 * beside + 3 * above + across + 8) >> 4;
}
