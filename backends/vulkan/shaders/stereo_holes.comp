// Stage stereo, the end of section 10, and section 11: speckles go, and small holes are filled.
// Confidences are final here. A work group per tile of 32 x 32 samples.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo.glsl"
#include "stereo_evidence.glsl"
layout(constant_id = 0) const int kRadius = 3;
layout(constant_id = 1) const int kRun = 8;  // samples along a line that an invocation sums up for
layout(local_size_x = 32, local_size_y_id = 2) in;
layout(std430, set = 0, binding = 0) readonly buffer Words { uint words[]; };
layout(std430, set = 0, binding = 1) writeonly buffer To { int16_t to[]; };
layout(std430, set = 0, binding = 2) writeonly buffer Confidence { uint8_t confidence[]; };
layout(std430, set = 0, binding = 3) writeonly buffer Evidence { int16_t evidence[]; };

const int kTile = 32, kRuns = kTile / kRun, kInvocations = kTile * kRuns;
const int kSide = kTile + 2 * kRadius;  // of a tile with the windows of its holes
const int kSideRuns = (kSide + kRun - 1) / kRun, kCells = kSideRuns * kRun + 2 * kSpeckleRadius;
const int kOne = 1 << 16;  // a cell counts its sample above the sum of differences

shared uint cells[kCells][kCells + 1];
shared int row_sums[kCells][kSideRuns * kRun + 1];

int count_of(uint word) { return is_evidence(word) ? 1 : 0; }
int summand_of(uint word) { return is_evidence(word) ? kOne + difference_of(word) : 0; }

int rounds(int tasks) { return (tasks + kInvocations - 1) / kInvocations; }

// Speckles become holes.
void drop_speckles(int me) {
    const int reach = kRun + 2 * kSpeckleRadius;
    [[unroll]] for (int t = 0; t < rounds(kCells * kSideRuns); ++t) {
        const int i = me + t * kInvocations;
        if (i >= kCells * kSideRuns) continue;
        const int row = i % kCells, first = i / kCells * kRun;
        int line[reach], sum = 0;
        [[unroll]] for (int u = 0; u < reach; ++u) {
            line[u] = count_of(cells[row][first + u]);
            sum += line[u];
            if (u < 2 * kSpeckleRadius) continue;
            row_sums[row][first + u - 2 * kSpeckleRadius] = sum;
            sum -= line[u - 2 * kSpeckleRadius];
        }
    }
    barrier();
    [[unroll]] for (int t = 0; t < rounds(kSide * kSideRuns); ++t) {
        const int i = me + t * kInvocations;
        if (i >= kSide * kSideRuns) continue;
        const int column = i % kSide, first = i / kSide * kRun;
        int line[reach], sum = 0;
        [[unroll]] for (int v = 0; v < reach; ++v) {
            line[v] = row_sums[first + v][column];
            sum += line[v];
            if (v < 2 * kSpeckleRadius) continue;
            const int y = first + v - kSpeckleRadius, x = column + kSpeckleRadius;
            if (sum < push.support) cells[y][x] = no_evidence(hypothesis_of(cells[y][x]));
            sum -= line[v - 2 * kSpeckleRadius];
        }
    }
    barrier();
}

void main() {
    const ivec2 tile = ivec2(gl_WorkGroupID.xy) * kTile;
    const int me = int(gl_LocalInvocationIndex);
    for (int i = me; i < kCells * kCells; i += kInvocations) {
        const ivec2 at = tile - kRadius - kSpeckleRadius + ivec2(i % kCells, i / kCells);
        const bool inside =
            all(greaterThanEqual(at, ivec2(0))) && at.x < push.samples_x && at.y < push.samples_y;
        cells[i / kCells][i % kCells] =
            inside ? words[at.y * push.samples_x + at.x] : no_evidence(0);
    }
    barrier();
    drop_speckles(me);
    const int reach = kRun + 2 * kRadius, side = 2 * kRadius + 1;
    [[unroll]] for (int t = 0; t < rounds(kSide * kRuns); ++t) {
        const int i = me + t * kInvocations;
        if (i >= kSide * kRuns) continue;
        const int row = i % kSide, first = i / kSide * kRun;
        int line[reach], sum = 0;
        [[unroll]] for (int u = 0; u < reach; ++u) {
            line[u] = summand_of(cells[row + kSpeckleRadius][first + kSpeckleRadius + u]);
            sum += line[u];
            if (u < 2 * kRadius) continue;
            row_sums[row][first + u - 2 * kRadius] = sum;
            sum -= line[u - 2 * kRadius];
        }
    }
    barrier();
    const int column = int(gl_LocalInvocationID.x), first = kRun * int(gl_LocalInvocationID.y),
              x = tile.x + column;
    if (x >= push.samples_x) return;
    int line[reach], sums = 0;
    [[unroll]] for (int v = 0; v < reach; ++v) {
        line[v] = row_sums[first + v][column];
        sums += line[v];
        if (v < 2 * kRadius) continue;
        const int row = first + v - 2 * kRadius, y = tile.y + row, at = y * push.samples_x + x;
        if (y < push.samples_y) {
            const uint word =
                cells[row + kRadius + kSpeckleRadius][column + kRadius + kSpeckleRadius];
            const int m = (sums + kOne / 2) >> 16, sum = sums - m * kOne;
            int disparity =
                is_evidence(word) ? hypothesis_of(word) + difference_of(word) : kNoDisparity;
            if (is_given(kOutEvidence)) evidence[at] = int16_t(disparity);
            int sure = confidence_of(word);
            if (!is_evidence(word) && 2 * m >= side * side) {
                disparity = max(0, hypothesis_of(word) + floor_divide(2 * sum + m, 2 * m));
                sure = kFilledConfidence;
            }
            to[at] = int16_t(disparity);
            if (is_given(kOutConfidence)) [[unroll]]
                for (int k = 0; k < 4; ++k) {
                    const ivec2 pixel = 2 * ivec2(x, y) + ivec2(k & 1, k >> 1);
                    if (pixel.x < push.width && pixel.y < push.height)
                        confidence[pixel.y * push.stride + pixel.x] = uint8_t(sure);
                }
        }
        sums -= line[v - 2 * kRadius];
    }
}
