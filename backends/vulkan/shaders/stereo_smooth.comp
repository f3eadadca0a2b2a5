// Stage stereo, sections 12 and 13: smooths the samples a number of times, each along rows and then
// along columns; the last time it gives the result between them. A work group has a tile of 30 x 30
// samples, with what each pass needs around it.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "backends/stages/stereo.hpp"
#include "stereo_push.h"
#include "stereo_smooth.glsl"
layout(constant_id = 0) const int kRadius = 2;
layout(constant_id = 1) const int kRange = 24;
layout(constant_id = 2) const int kPasses = 4;
layout(constant_id = 3) const bool kLast = true;
layout(constant_id = 4) const int kRun = 8;  // samples along a line that an invocation smooths
layout(constant_id = 5) const int kResultRun = 2;  // rows of samples that it gives the pixels of
layout(constant_id = 6) const int kInvocations = 144;
layout(local_size_x_id = 6) in;
layout(std430, set = 0, binding = 0) readonly buffer From { int16_t from[]; };
layout(std430, set = 0, binding = 1) writeonly buffer To { int16_t to[]; };
layout(push_constant) uniform Push { SmoothSize push; };

const int kTile = 30;
// Samples around the tile, and one on the far sides for those between; even, as are all that
// follow.
const int kMargin = (kPasses * kRadius + kRadius % 2 + 1) / 2 * 2, kSide = kTile + 2 + 2 * kMargin,
          kWords = kSide / 2;
const int kReach = kRun + 2 * kRadius;  // a run with its neighbours

// Two samples beside each other in a word.
shared int cells[kSide + kRun][kWords + kRun / 2 + 1];
shared int rows[kSide + kRun][kWords + kRun / 2 + 1];

int packed(int left, int right) { return (left & 0xffff) | right << 16; }
ivec2 unpacked(int word) { return ivec2((word << 16) >> 16, word >> 16); }

int rounds(int tasks) { return (tasks + kInvocations - 1) / kInvocations; }

int smooth_one(int line[kReach], int i) {
    int n = 1, sum = 0;
    [[unroll]] for (int u = 0; u <= 2 * kRadius; ++u) if (u != kRadius) sum +=
        near_sum(line[i + u] - line[i + kRadius], kRange, n);
    return moved(line[i + kRadius], sum, n);
}

void put(int x, int y, int disparity) {
    if (x < push.width && y < push.height) to[y * push.stride + x] = int16_t(disparity);
}

// The pixels of a sample, from it and those to the right of it, below, and across.
void give_pixels(ivec2 sample_at, int a, ivec3 others) {
    int n = 1;
    ivec3 change;
    [[unroll]] for (int k = 0; k < 3; ++k) change[k] = near_sum(others[k] - a, kRange, n);
    const ivec2 halfway = a + ((change.xy + 1) >> 1);
    // A third: 2 sum + n is odd, so that the reciprocal's error does not matter.
    const int twice = 2 * (change.x + change.y + change.z) + n;
    const int middle = a + (n == 3 ? (twice * 10923) >> 16 : n == 4 ? twice >> 3 : twice >> n);
    const int x = 2 * sample_at.x, y = 2 * sample_at.y;
    put(x, y, a);
    put(x + 1, y, halfway.x);
    put(x, y + 1, halfway.y);
    put(x + 1, y + 1, middle);
}

// The pixels of kResultRun rows of two samples of the tile.
void give_result(ivec2 tile, int column, int first) {
    const ivec2 place = kMargin + ivec2(column, first);
    ivec3 above =
        ivec3(unpacked(cells[place.y][place.x / 2]), unpacked(cells[place.y][place.x / 2 + 1]).x);
    [[unroll]] for (int v = 0; v < kResultRun; ++v) {
        ivec3 below = ivec3(unpacked(cells[place.y + v + 1][place.x / 2]),
                            unpacked(cells[place.y + v + 1][place.x / 2 + 1]).x);
        const ivec3 next = below;
        const ivec2 at = tile + ivec2(column, first + v);
        if (at.x + 1 >= push.samples_x) {
            above.y = above.x;
            below.y = below.x;
        }
        if (at.x + 2 >= push.samples_x) {
            above.z = above.y;
            below.z = below.y;
        }
        if (at.y + 1 >= push.samples_y) below = above;
        give_pixels(at, above.x, ivec3(above.y, below.xy));
        give_pixels(at + ivec2(1, 0), above.y, ivec3(above.z, below.yz));
        above = next;
    }
}

// The samples of the tile and those around it.
void load_cells(ivec2 tile, int me) {
    for (int i = me; i < kSide * kWords; i += kInvocations) {
        const int row = i / kWords, word = i % kWords, y = tile.y - kMargin + row,
                  x = tile.x - kMargin + 2 * word;
        const bool inside = y >= 0 && y < push.samples_y;
        const int at = y * push.samples_x + x;
        const int left = inside && x >= 0 && x < push.samples_x ? int(from[at]) : kNoDisparity,
                  right =
                      inside && x >= 0 && x + 1 < push.samples_x ? int(from[at + 1]) : kNoDisparity;
        cells[row][word] = packed(left, right);
    }
    barrier();
}

// One pass, from cells along rows into rows, and from there along columns.
void smooth_cells(int pass, int me) {
    // As far into the margin as the passes that follow need.
    const int first = (kMargin - (kPasses - pass) * kRadius) / 2 * 2, side = kSide - 2 * first,
              runs = (side + kRun - 1) / kRun, read = side + 2 * kRadius;
    int line[kReach];
    [[unroll]] for (int t = 0; t < rounds(read * runs); ++t) {
        const int i = me + t * kInvocations;
        if (i >= read * runs) continue;
        const int row = first - kRadius + i % read, word = first / 2 + i / read * (kRun / 2);
        [[unroll]] for (int k = -1; k <= kRun / 2; ++k) {
            const ivec2 two = unpacked(cells[row][word + k]);
            const int at = 2 * k + kRadius;
            if (at >= 0) line[at] = two.x;
            if (at + 1 < kReach) line[at + 1] = two.y;
        }
        [[unroll]] for (int k = 0; k < kRun / 2; ++k) rows[row][word + k] =
            packed(smooth_one(line, 2 * k), smooth_one(line, 2 * k + 1));
    }
    barrier();
    [[unroll]] for (int t = 0; t < rounds(side / 2 * runs); ++t) {
        const int i = me + t * kInvocations;
        if (i >= side / 2 * runs) continue;
        const int word = first / 2 + i % (side / 2), row = first + i / (side / 2) * kRun;
        int second_line[kReach];
        [[unroll]] for (int v = 0; v < kReach; ++v) {
            const ivec2 two = unpacked(rows[row - kRadius + v][word]);
            line[v] = two.x;
            second_line[v] = two.y;
        }
        [[unroll]] for (int v = 0; v < kRun; ++v) cells[row + v][word] =
            packed(smooth_one(line, v), smooth_one(second_line, v));
    }
    barrier();
}

void main() {
    const ivec2 tile = ivec2(gl_WorkGroupID.xy) * kTile;
    const int me = int(gl_LocalInvocationIndex);
    load_cells(tile, me);
    [[unroll]] for (int pass = 1; pass <= kPasses; ++pass) smooth_cells(pass, me);
    if (kLast) {
        const int tasks = kTile / 2 * (kTile / kResultRun);
        [[unroll]] for (int t = 0; t < rounds(tasks); ++t) {
            const int i = me + t * kInvocations;
            if (i < tasks) give_result(tile, i % (kTile / 2) * 2, i / (kTile / 2) * kResultRun);
        }
    } else {
        for (int i = me; i < kTile * kTile; i += kInvocations) {
            const int column = i % kTile, row = i / kTile, x = tile.x + column, y = tile.y + row;
            if (x < push.samples_x && y < push.samples_y)
                to[y * push.samples_x + x] =
                    int16_t(unpacked(cells[kMargin + row][(kMargin + column) / 2])[column & 1]);
        }
    }
}
