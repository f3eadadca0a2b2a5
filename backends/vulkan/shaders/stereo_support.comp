// Stage stereo, sections 4 and 5, and of section 6 what leads to the dense field: the smoothed
// samples, and the coarser fields as far as a tile reaches. A work group per tile of
// samples. stereo_statistics.comp, or stereo_search_wide.comp, has looked at the left pixels.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo.glsl"
#include "stereo_pyramid.glsl"
#include "stereo_smooth.glsl"
layout(constant_id = 0) const int kTileLevels = 5;  // coarser fields that a work group makes
layout(constant_id = 1) const int kRun = 4;  // samples beside each other that an invocation counts
                                             // the support of
layout(local_size_x_id = 2) in;              // enough for all of these
const int kInvocations = int(gl_WorkGroupSize.x);

layout(std430, set = 0, binding = 0) readonly buffer Candidates { uint16_t candidates[]; };
layout(std430, set = 0, binding = 1) readonly buffer RightKeys { int right_keys[]; };
layout(std430, set = 0, binding = 2) readonly buffer LeftUsable { uint8_t left_usable[]; };
layout(std430, set = 0, binding = 3) readonly buffer RightMask { uint8_t right_mask[]; };
layout(std430, set = 0, binding = 4) writeonly buffer Checked { int16_t checked[]; };
layout(std430, set = 0, binding = 5) writeonly buffer Supported { int16_t supported[]; };
layout(std430, set = 0, binding = 6) writeonly buffer Pyramid { int16_t pyramid[]; };

const int kTile = 1 << kTileLevels;
const int kMargin = kHalfSmoothRadius, kSupportSide = kTile + 2 * kMargin;
const int kRuns = (kSupportSide + kRun - 1) / kRun;
const int kCheckedMargin = kMargin + kSupportRadius, kRows = kTile + 2 * kCheckedMargin,
          kColumns = kRuns * kRun + 2 * kSupportRadius;

shared int cells[kRows][kColumns + 1];  // checked; later each coarser field of the tile
shared int agreed[kSupportSide][kRuns * kRun + 1];
shared int rows[kSupportSide][kTile + 1];

int check(ivec2 at) {
    if (any(lessThan(at, ivec2(0))) || at.x >= push.half_samples_x || at.y >= push.half_samples_y)
        return kNoDisparity;
    const int candidate = int(candidates[at.y * push.half_samples_x + at.x]);
    const int pixel = at.y * push.half_width + 2 * at.x;
    if (candidate == 0 || int(left_usable[pixel]) == 0) return kNoDisparity;
    const int index = candidate - 1, d = push.first + index;
    const bool agrees = abs((right_keys[pixel - d] & 255) - index) <= push.left_right;
    return agrees && int(right_mask[pixel - d]) != 0 ? 16 * d : kNoDisparity;
}

// Whether a sample of the tile is one of the field.
bool inside(ivec2 tile, int column, int row) {
    return tile.x + column < push.half_samples_x && tile.y + row < push.half_samples_y;
}

// Section 4, for the tile and what lies around it.
void check_tile(ivec2 tile, int me) {
    for (int i = me; i < kRows * kColumns; i += kInvocations) {
        const ivec2 place = ivec2(i % kColumns, i / kColumns) - kCheckedMargin, at = tile + place;
        const int disparity = check(at);
        cells[i / kColumns][i % kColumns] = disparity;
        if (is_given(kOutChecked) && all(greaterThanEqual(place, ivec2(0))) &&
            all(lessThan(place, ivec2(kTile))) && inside(tile, place.x, place.y))
            checked[at.y * push.half_samples_x + at.x] = int16_t(disparity);
    }
}

// Section 5, for the invocation's run.
void keep_supported(ivec2 tile, int me) {
    if (me >= kSupportSide * kRuns) return;
    const int row = me / kRuns, first = me % kRuns * kRun;
    int centre[kRun], agreeing[kRun];
    [[unroll]] for (int m = 0; m < kRun; ++m) {
        centre[m] = cells[row + kSupportRadius][first + m + kSupportRadius];
        agreeing[m] = 0;
    }
    // A missing one differs from every disparity by more than the range.
    [[unroll]] for (int v = 0; v <= 2 * kSupportRadius; ++v)
        [[unroll]] for (int u = 0; u < kRun + 2 * kSupportRadius; ++u) {
        const int other = cells[row + v][first + u];
        [[unroll]] for (int m = max(u - 2 * kSupportRadius, 0); m <= min(u, kRun - 1); ++m)
            agreeing[m] += abs(other - centre[m]) <= kSupportRange ? 1 : 0;
    }
    [[unroll]] for (int m = 0; m < kRun; ++m) {
        const int disparity = agreeing[m] >= push.support ? centre[m] : kNoDisparity;
        agreed[row][first + m] = disparity;
        const int x = first + m - kMargin, y = row - kMargin;
        if (x >= 0 && x < kTile && y >= 0 && y < kTile && inside(tile, x, y))
            supported[(tile.y + y) * push.half_samples_x + tile.x + x] = int16_t(disparity);
    }
}

// The finest field of the pyramid.
void smooth_supported(ivec2 tile, int me) {
    for (int i = me; i < kSupportSide * kTile; i += kInvocations) {
        const int row = i / kTile, column = i % kTile;
        rows[row][column] = smoothed(agreed[row][column], agreed[row][column + 1],
                                     agreed[row][column + 2], kSearchSmoothRange);
    }
    barrier();
    for (int i = me; i < kTile * kTile; i += kInvocations) {
        const int row = i / kTile, column = i % kTile;
        const int disparity = smoothed(rows[row][column], rows[row + 1][column],
                                       rows[row + 2][column], kSearchSmoothRange);
        cells[row][column] = disparity;
        if (inside(tile, column, row))
            pyramid[(tile.y + row) * push.half_samples_x + tile.x + column] = int16_t(disparity);
    }
}

// The coarser fields, as far as the tile reaches.
void make_coarser(ivec2 tile, int me) {
    Level fine = finest_level();
    for (int level = 1; level <= kTileLevels && !is_coarsest(fine); ++level) {
        // The pixel (x, y) of the tile's field is the cell (x << level - 1, y << level - 1).
        const Level coarse = coarser_than(fine);
        const int side = kTile >> level, apart = 1 << (level - 1);
        for (int i = me; i < side * side; i += kInvocations) {
            const int x = i % side, y = i / side, column = 2 * x * apart, row = 2 * y * apart;
            const int mean =
                mean_of(ivec4(cells[row][column], cells[row][column + apart],
                              cells[row + apart][column], cells[row + apart][column + apart]));
            cells[row][column] = mean;
            const int u = (tile.x >> level) + x, v = (tile.y >> level) + y;
            if (u < coarse.width && v < coarse.height)
                pyramid[coarse.offset + v * coarse.width + u] = int16_t(mean);
        }
        fine = coarse;
        barrier();
    }
}

void main() {
    const ivec2 tile = ivec2(gl_WorkGroupID.xy) * kTile;
    const int me = int(gl_LocalInvocationIndex);
    check_tile(tile, me);
    barrier();
    keep_supported(tile, me);
    barrier();
    smooth_supported(tile, me);
    barrier();
    make_coarser(tile, me);
}
