// Stage stereo, section 6 the holes, and section 7. A work group has a tile of samples: it
// fills the whole of the coarsest fields, those that stereo_support.comp made last and beyond, and
// of the finer ones what its tile needs.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo.glsl"
#include "stereo_pyramid.glsl"
layout(constant_id = 0) const int kCoarseCells = 1024;  // of the fields that are filled as a whole
layout(constant_id = 1) const int kTileLevels = 5;
layout(constant_id = 2) const int kRun = 4;  // samples beside each other that an invocation
                                             // classifies, one run each
layout(local_size_x_id = 3) in;
layout(std430, set = 0, binding = 0) readonly buffer Pyramid { int16_t pyramid[]; };
layout(std430, set = 0, binding = 1) readonly buffer Supported { int16_t supported[]; };
layout(std430, set = 0, binding = 2) writeonly buffer Dense { int16_t dense[]; };
layout(std430, set = 0, binding = 3) writeonly buffer Standing { uint8_t standing[]; };

const int kTile = 1 << kTileLevels, kInvocations = kTile * kTile / kRun;
const int kFields = kTileLevels + 1;  // the finer ones, and the one after them
// Cells of the tile in each field, and two more on each side: what one field needs of the next
// coarser one then reaches as far.
const int kMargin = kEdgeRadius, kSide = kTile + 2 * kMargin;

shared int with_holes;  // bits of the finer fields
shared int coarse_cells[kCoarseCells];
shared int cells[kSide * kSide * 5 / 3];  // of the finer fields, one after the other

int side_of(int level) { return (kTile >> level) + 2 * kMargin; }
int cells_before(int level) {
    int sum = 0;
    [[unroll]] for (int i = 0; i < level; ++i) sum += side_of(i) * side_of(i);
    return sum;
}
// A cell of a field of which the tile's cells begin at pixel `first`.
int cell(int level, ivec2 first, ivec2 at) {
    return cells[cells_before(level) + (at.y - first.y) * side_of(level) + at.x - first.x];
}

int coarse_cell(Level level, ivec2 at) {
    at = clamp(at, ivec2(0), ivec2(level.width, level.height) - 1);
    return coarse_cells[level.offset + at.y * level.width + at.x];
}

// For a hole at `at`: the pixel of the coarser field that it lies in, and the one across.
ivec2 near_of(ivec2 at) { return at >> 1; }
ivec2 far_of(ivec2 at) { return (at >> 1) + 2 * (at & 1) - 1; }

int coarse_filled(Level coarse, ivec2 at) {
    const ivec2 near = near_of(at), far = far_of(at);
    return filled(coarse_cell(coarse, near), coarse_cell(coarse, ivec2(far.x, near.y)),
                  coarse_cell(coarse, ivec2(near.x, far.y)), coarse_cell(coarse, far));
}

// Fills the coarsest field that the tiles made, and those beyond.
void fill_coarse(Level finest, int me) {
    const int before = finest.offset;
    finest.offset = 0;
    for (int i = me; i < finest.width * finest.height; i += kInvocations)
        coarse_cells[i] = int(pyramid[before + i]);
    barrier();
    int levels = 0;
    for (Level fine = finest; !is_coarsest(fine); ++levels) {
        const Level coarse = coarser_than(fine);
        for (int i = me; i < coarse.width * coarse.height; i += kInvocations) {
            const int x = 2 * (i % coarse.width), y = 2 * (i / coarse.width);
            const bool right = x + 1 < fine.width, below = y + 1 < fine.height;
            const int at = fine.offset + y * fine.width + x;
            coarse_cells[coarse.offset + i] =
                mean_of(ivec4(coarse_cells[at], right ? coarse_cells[at + 1] : kNoDisparity,
                              below ? coarse_cells[at + fine.width] : kNoDisparity,
                              right && below ? coarse_cells[at + fine.width + 1] : kNoDisparity));
        }
        fine = coarse;
        barrier();
    }
    for (int level = levels - 1; level >= 0; --level) {
        Level fine = finest;
        for (int i = 0; i < level; ++i) fine = coarser_than(fine);
        const Level coarse = coarser_than(fine);
        for (int i = me; i < fine.width * fine.height; i += kInvocations)
            if (coarse_cells[fine.offset + i] == kNoDisparity)
                coarse_cells[fine.offset + i] =
                    coarse_filled(coarse, ivec2(i % fine.width, i / fine.width));
        barrier();
    }
}

// The tile's cells of each finer field; returns the field after the last of them.
int load_cells(ivec2 tile, int me, out Level levels[kFields]) {
    if (me == 0) with_holes = 0;
    barrier();
    levels[0] = finest_level();
    int last = 0;
    [[unroll]] for (int level = 0; level < kTileLevels; ++level) {
        levels[level + 1] = levels[level];
        const bool coarsest = is_coarsest(levels[level]);
        if (coarsest && level > 0) continue;
        const int side = side_of(level);
        const ivec2 first = (tile >> level) - kMargin,
                    end = ivec2(levels[level].width, levels[level].height) - 1;
        bool holes = false;
        for (int i = me; i < side * side; i += kInvocations) {
            const ivec2 at = clamp(first + ivec2(i % side, i / side), ivec2(0), end);
            const int disparity =
                int(pyramid[levels[level].offset + at.y * levels[level].width + at.x]);
            cells[cells_before(level) + i] = disparity;
            holes = holes || disparity == kNoDisparity;
        }
        if (holes) atomicOr(with_holes, 1 << level);
        if (coarsest) continue;
        levels[level + 1] = coarser_than(levels[level]);
        last = level + 1;
    }
    barrier();
    return last;
}

// From the cells of the next coarser field, of size `coarse`.
int tile_filled(ivec2 tile, int level, Level coarse, ivec2 at) {
    const ivec2 first = (tile >> level) - kMargin, end = ivec2(coarse.width, coarse.height) - 1,
                near = clamp(near_of(at), ivec2(0), end), far = clamp(far_of(at), ivec2(0), end);
    return filled(cell(level, first, near), cell(level, first, ivec2(far.x, near.y)),
                  cell(level, first, ivec2(near.x, far.y)), cell(level, first, far));
}

// The holes of the tile's cells.
void fill_cells(ivec2 tile, int me, Level levels[kFields], int last) {
    const int whole = findLSB(~with_holes);  // the finest without holes: none beyond is needed
    Level coarsest = levels[kTileLevels];
    if (whole >= last) fill_coarse(coarsest, me);
    coarsest.offset = 0;
    [[unroll]] for (int level = kTileLevels - 1; level >= 0; --level) {
        if (level >= last || level >= whole) continue;
        const int side = side_of(level);
        const ivec2 first = (tile >> level) - kMargin,
                    end = ivec2(levels[level].width, levels[level].height) - 1;
        for (int i = me; i < side * side; i += kInvocations) {
            if (cells[cells_before(level) + i] != kNoDisparity) continue;
            const ivec2 at = clamp(first + ivec2(i % side, i / side), ivec2(0), end);
            cells[cells_before(level) + i] =
                level + 1 == last ? coarse_filled(coarsest, at)
                                  : tile_filled(tile, level + 1, levels[level + 1], at);
        }
        barrier();
    }
}

// Section 7, for the invocation's run.
void give_standing(ivec2 tile, int me) {
    const int row = me / (kTile / kRun), column = me % (kTile / kRun) * kRun, y = tile.y + row;
    if (y >= push.half_samples_y) return;
    int lowest[kRun + 2 * kMargin], highest[kRun + 2 * kMargin], centre[kRun];
    [[unroll]] for (int u = 0; u < kRun + 2 * kMargin; ++u) {
        lowest[u] = highest[u] = cells[row * kSide + column + u];
        [[unroll]] for (int v = 1; v <= 2 * kMargin; ++v) {
            const int other = cells[(row + v) * kSide + column + u];
            lowest[u] = min(lowest[u], other);
            highest[u] = max(highest[u], other);
            if (v == kMargin && u >= kMargin && u < kMargin + kRun) centre[u - kMargin] = other;
        }
    }
    [[unroll]] for (int m = 0; m < kRun; ++m) {
        const int x = tile.x + column + m, at = y * push.half_samples_x + x;
        if (x >= push.half_samples_x) continue;
        int minimum = lowest[m], maximum = highest[m];
        [[unroll]] for (int u = 1; u <= 2 * kMargin; ++u) {
            minimum = min(minimum, lowest[m + u]);
            maximum = max(maximum, highest[m + u]);
        }
        const bool doubtful = centre[m] - minimum > push.edge;
        const bool open = maximum - minimum > push.edge || int(supported[at]) == kNoDisparity;
        dense[at] = int16_t(centre[m]);
        standing[at] = uint8_t(doubtful ? kDoubtful : open ? kOpen : kSettled);
    }
}

void main() {
    const ivec2 tile = ivec2(gl_WorkGroupID.xy) * kTile;
    const int me = int(gl_LocalInvocationIndex);
    Level levels[kFields];
    const int last = load_cells(tile, me, levels);
    fill_cells(tile, me, levels, last);
    give_standing(tile, me);
}
