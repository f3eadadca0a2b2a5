// Stage orb, section 1: level 0, 4 x 4 pixels per invocation; and the mask in the same shape, a
// byte 0 or 255.
#version 450
#extension GL_EXT_shader_8bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "halving.glsl"
#include "orb.glsl"
const int kColumns = 32, kRows = 4;
layout(local_size_x = kColumns, local_size_y = kRows) in;
layout(constant_id = 0) const int kHalvings = 0;

layout(std430, set = 0, binding = 1) readonly buffer Gray { uint8_t gray[]; };
layout(std430, set = 0, binding = 2) readonly buffer Mask { uint8_t mask[]; };
layout(std430, set = 0, binding = 3) writeonly buffer Pyramid { uint pyramid[]; };
layout(std430, set = 0, binding = 4) writeonly buffer Masks { uint masks[]; };

// What the work group takes of the halved image: its pixels and those round them.
const int kTileColumns = 4 * kColumns + 2, kTileRows = 4 * kRows + 2;
shared int tile[kHalvings > 0 ? kTileRows : 1][kTileColumns];

int gray0(int x, int y) { return int(gray[y * push.stride + x]); }
HALVED(gray1, gray0, mean_of)
HALVED(gray2, gray1, mean_of)
HALVED(gray3, gray2, mean_of)
int mask0(int x, int y) { return int(mask[y * push.stride + x]); }
HALVED(mask1, mask0, least_of)
HALVED(mask2, mask1, least_of)
HALVED(mask3, mask2, least_of)

ivec2 tile_corner() { return ivec2(gl_WorkGroupID.xy) * 4 * ivec2(kColumns, kRows) - 1; }
void load_tile(OrbLevel level) {
    for (int i = int(gl_LocalInvocationIndex); i < kTileColumns * kTileRows;
         i += kColumns * kRows) {
        const ivec2 in_tile = ivec2(i % kTileColumns, i / kTileColumns),
                    at = tile_corner() + in_tile;
        if (at.x < 0 || at.y < 0 || at.x >= level.width || at.y >= level.height) continue;
        tile[in_tile.y][in_tile.x] = kHalvings == 1   ? gray1(at.x, at.y)
                                     : kHalvings == 2 ? gray2(at.x, at.y)
                                                      : gray3(at.x, at.y);
    }
}

int pixel_at(OrbLevel level, int x, int y) {
    const ivec2 at = clamp(ivec2(x, y), ivec2(0), ivec2(level.width, level.height) - 1);
    if (kHalvings == 0) return gray0(at.x, at.y);
    const ivec2 in_tile = at - tile_corner();
    return tile[in_tile.y][in_tile.x];
}
int usable_at(int x, int y) {
    return kHalvings == 0   ? mask0(x, y)
           : kHalvings == 1 ? mask1(x, y)
           : kHalvings == 2 ? mask2(x, y)
                            : mask3(x, y);
}

// The sums under 1 2 1 along the row.
ivec4 across(OrbLevel level, int x, int y) {
    int p[6];
    for (int i = 0; i < 6; ++i) p[i] = pixel_at(level, x - 1 + i, y);
    return ivec4(p[0], p[1], p[2], p[3]) + 2 * ivec4(p[1], p[2], p[3], p[4]) +
           ivec4(p[2], p[3], p[4], p[5]);
}

uint usable(OrbLevel level, int x, int y) {
    ivec4 bytes;
    for (int i = 0; i < 4; ++i) bytes[i] = usable_at(min(x + i, level.width - 1), y) != 0 ? 255 : 0;
    return packed(bytes);
}

void main() {
    const OrbLevel level = levels[0];
    if (kHalvings > 0) {
        load_tile(level);
        barrier();
    }
    const int x_word = int(gl_GlobalInvocationID.x), first = 4 * int(gl_GlobalInvocationID.y);
    const int x = 4 * x_word;
    if (x >= level.width || first >= level.height) return;
    ivec4 above = across(level, x, first - 1), here = across(level, x, first);
    for (int y = first; y < min(first + 4, level.height); ++y) {
        const ivec4 below = across(level, x, y + 1);
        pyramid[word_at(level, x_word, y)] = packed((above + 2 * here + below + 8) >> 4);
        if (given.mask != 0) masks[word_at(level, x_word, y)] = usable(level, x, y);
        above = here;
        here = below;
    }
}
