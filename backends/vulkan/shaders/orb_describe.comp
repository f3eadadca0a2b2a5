// Stage orb, sections 7 to 9: one work group per feature. An invocation sums one row of the disc
// and makes 8 bits of the descriptor; some score a neighbour.
#version 450
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "orb.glsl"
#include "records.glsl"
#define PIXELS int
#include "orb_circle.glsl"
layout(local_size_x = 32) in;

layout(std430, set = 0, binding = 1) readonly buffer Pyramid { uint8_t pyramid[]; };
layout(std430, set = 0, binding = 2) readonly buffer Smoothed { uint16_t smoothed[]; };
layout(std430, set = 0, binding = 3) readonly buffer Corners { uint corners[]; };
layout(std430, set = 0, binding = 4) readonly buffer Kept { uint kept_cells[]; };
layout(std430, set = 0, binding = 5) readonly buffer Patterns {
    uint patterns[];
};  // for each bin and test: x, y, x, y in 8 bits
layout(std430, set = 0, binding = 6) writeonly buffer Features { Feature features[]; };

const ivec2 kBinBorder[8] = DEFREC_ORB_BIN_BORDERS;
const ivec2 kScored[5] = ivec2[](ivec2(0, 0), ivec2(-1, 0), ivec2(1, 0), ivec2(0, -1), ivec2(0, 1));

shared ivec2 moments[32];
shared int scores[5];
shared uint bits[32];

int score_at(int at, int stride) {
    int circle[16];
    [[unroll]] for (int i = 0; i < 16; ++i) circle[i] =
        int(pyramid[at + kCircle[i].y * stride + kCircle[i].x]);
    return corner_score(int(pyramid[at]), circle);
}

ivec2 moments_of_row(int at, int stride, int dy) {
    const int half_width = kDiscHalfWidth[abs(dy)];
    ivec2 sum = ivec2(0);
    for (int dx = -half_width; dx <= half_width; ++dx)
        sum += ivec2(dx, 1) * int(pyramid[at + dy * stride + dx]);
    return ivec2(sum.x, dy * sum.y);
}

int angle_bin(ivec2 direction) {
    const ivec2 size = abs(direction);
    int k = 0;
    for (int i = 0; i < 8; ++i) k += size.y * kBinBorder[i].x > size.x * kBinBorder[i].y ? 1 : 0;
    if (direction.x < 0) k = kBins / 2 - k;
    return direction.y < 0 ? (kBins - k) & (kBins - 1) : k;
}

// The vertex of the parabola through three scores, 1/16 px.
int peak(int before, int middle, int after) {
    const int curvature = 2 * middle - before - after, slope = 8 * (after - before);
    if (curvature <= 0) return 0;
    if (slope >= 7 * curvature) return 7;
    if (slope <= -7 * curvature) return -7;
    return (2 * slope + 33 * curvature) / (2 * curvature) - 16;
}

// From 1/16 px of a level to 1/16 px of the image.
int to_image(uint sixteenths, uint level) {
    uint five = 1;
    for (uint l = 0; l < level; ++l) five *= 5;
    const uint half_unit = level == 0 ? 0 : 1u << (2 * level - 1);
    return int((((sixteenths + 8) * five << push.halvings) + half_unit) >> (2 * level)) - 8;
}

int smoothed_at(int at, int stride, int x, int y) { return int(smoothed[at + y * stride + x]); }

uint test_bits(int at, int stride, int bin, uint first) {
    uint result = 0;
    [[unroll]] for (uint i = 0; i < 8; ++i) {
        const int four = int(patterns[uint(bin * kTests) + first + i]);
        const int a =
            smoothed_at(at, stride, bitfieldExtract(four, 0, 8), bitfieldExtract(four, 8, 8));
        const int b =
            smoothed_at(at, stride, bitfieldExtract(four, 16, 8), bitfieldExtract(four, 24, 8));
        result |= a < b ? 1u << i : 0;
    }
    return result;
}

void main() {
    const uint me = gl_LocalInvocationIndex;
    const int cell_index = int(kept_cells[gl_WorkGroupID.x]);
    int l = 0;
    while (l + 1 < push.levels && cell_index >= int(levels[l + 1].first_cell)) ++l;
    const OrbLevel level = levels[l];
    const uint corner = corners[cell_index];
    const int in_level = cell_index - int(level.first_cell);
    const ivec2 cell = ivec2(in_level % level.cells_x, in_level / level.cells_x);
    const ivec2 place = kBorder + push.cell * cell + ivec2(corner & 255, corner >> 8 & 255);
    const int stride = level.stride, at = int(level.first) + place.y * stride + place.x;

    if (me < 5) scores[me] = score_at(at + kScored[me].y * stride + kScored[me].x, stride);
    moments[me] =
        me <= 2 * kPatchRadius ? moments_of_row(at, stride, int(me) - kPatchRadius) : ivec2(0);
    barrier();
    for (uint half_size = 16; half_size > 0; half_size >>= 1) {
        if (me < half_size) moments[me] += moments[me + half_size];
        barrier();
    }
    const int bin = angle_bin(moments[0]);
    bits[me] = test_bits(at, stride, bin, 8 * me);
    barrier();
    const uint feature = gl_WorkGroupID.x;
    if (me < 8)
        features[feature].descriptor[me] =
            bits[4 * me] | bits[4 * me + 1] << 8 | bits[4 * me + 2] << 16 | bits[4 * me + 3] << 24;
    if (me != 8) return;
    const ivec2 beyond =
        ivec2(peak(scores[1], scores[0], scores[2]), peak(scores[3], scores[0], scores[4]));
    const uvec2 fine = uvec2(16 * place + beyond);
    features[feature].x = to_image(fine.x, uint(l));
    features[feature].y = to_image(fine.y, uint(l));
    features[feature].level_angle = uint(l) | uint(bin) << 16;
    features[feature].score = corner >> 16;
}
