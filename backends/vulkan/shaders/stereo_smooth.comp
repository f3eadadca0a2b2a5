// Stage stereo, smoothing of section 6: along rows, then along columns. A work group per tile of 32 x 32 pixels.
#version 450
#extension GL_EXT_shader_16bit_storage : require
layout(local_size_x = 32, local_size_y = 8) in;

layout(constant_id = 0) const int kRadius = 3;
layout(constant_id = 1) const int kRange = 24;
layout(std430, set = 0, binding = 0) readonly buffer From { int16_t from[]; };
layout(std430, set = 0, binding = 1) writeonly buffer To { int16_t to[]; };
layout(push_constant) uniform Push {
    int width, height, to_stride;
} push;

const int kTile = 32, kSide = kTile + 2 * kRadius, kInvocations = 256;
const int kNone = -32768;
const int kReciprocal[8] = int[](0, 32767, 16384, 10923, 8192, 6554, 5461, 4681);

shared int cells[kSide][kSide];
shared int rows[kSide][kTile];

// Neighbours join the mean one by one. A missing one differs from every disparity by more than the range.
void add(int neighbour, int centre, inout int sum, inout int n) {
    const int difference = neighbour - centre;
    if (abs(difference) > kRange) return;
    sum += difference;
    ++n;
}
int mean(int centre, int sum, int n) { return centre == kNone ? kNone : centre + ((sum * kReciprocal[n] + (1 << 14)) >> 15); }

void main() {
    const ivec2 tile = ivec2(gl_WorkGroupID.xy) * kTile;
    const int me = int(gl_LocalInvocationIndex);
    for (int i = me; i < kSide * kSide; i += kInvocations) {
        const int x = tile.x - kRadius + i % kSide, y = tile.y - kRadius + i / kSide;
        const bool inside = x >= 0 && x < push.width && y >= 0 && y < push.height;
        cells[i / kSide][i % kSide] = inside ? int(from[y * push.width + x]) : kNone;
    }
    barrier();
    for (int i = me; i < kSide * kTile; i += kInvocations) {
        const int row = i / kTile, column = i % kTile, centre = cells[row][column + kRadius];
        int sum = 0, n = 0;
        for (int u = 0; u <= 2 * kRadius; ++u) add(cells[row][column + u], centre, sum, n);
        rows[row][column] = mean(centre, sum, n);
    }
    barrier();
    for (int i = me; i < kTile * kTile; i += kInvocations) {
        const int row = i / kTile, column = i % kTile, centre = rows[row + kRadius][column];
        int sum = 0, n = 0;
        for (int v = 0; v <= 2 * kRadius; ++v) add(rows[row + v][column], centre, sum, n);
        const int x = tile.x + column, y = tile.y + row;
        if (x < push.width && y < push.height) to[y * push.to_stride + x] = int16_t(mean(centre, sum, n));
    }
}
