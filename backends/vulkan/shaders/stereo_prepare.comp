// Stage stereo, sections 1 and 2: one image inpainted and halved, in words (stereo.glsl), with the
// mask of half resolution; with the right one the winners' keys are cleared. A work group per tile
// of 32 x 32 pixels.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo.glsl"
layout(constant_id = 0) const bool kRight = false;
layout(constant_id = 1) const int kInvocations = 64;
layout(local_size_x_id = 1) in;
layout(std430, set = 0, binding = 0) readonly buffer Source { uint source[]; };
layout(std430, set = 0, binding = 1) readonly buffer Mask { uint mask[]; };
layout(std430, set = 0, binding = 2) writeonly buffer Words {
    uint words[];
};  // column words of the left image, row words of the right one
layout(std430, set = 0, binding = 3) writeonly buffer HalfColumns { uint half_columns[]; };
layout(std430, set = 0, binding = 4) writeonly buffer HalfRows { uint half_rows[]; };  // right only
layout(std430, set = 0, binding = 5) writeonly buffer HalfMask {
    uint8_t half_mask[];
};  // of even rows
layout(std430, set = 0, binding = 6) writeonly buffer Gray { uint8_t gray[]; };
layout(std430, set = 0, binding = 7) writeonly buffer RightKeys {
    int right_keys[];
};  // right only

const int kTile = 32, kHalf = kTile / 2;
const int kWords = kTile * kTile / 4;  // of the tile
const int kRun = 8;                    // pixels that an invocation sums up windows for
const int kReach = kRun + 2 * kInpaintRadius, kSide = kTile + 2 * kInpaintRadius;
const int kOne = 1 << 20;  // a cell counts its pixel above the sum of grays

shared int any_masked;
// Words of four pixels of a row.
shared uint rows[kTile + kHalf][kTile / 4];  // of the tile, inpainted; then of it halved
shared uint masked[kTile][kTile / 4];        // 255 in a masked pixel
shared int cells[kSide][kSide + 1];
shared int row_sums[kSide][kTile + 1];

int rounds(int tasks) { return (tasks + kInvocations - 1) / kInvocations; }
bool is_task(int i, int tasks) { return tasks % kInvocations == 0 || i < tasks; }

uint bytes_from(uint word, uint next, int byte) {
    return byte == 0 ? word : word >> (8 * byte) | next << (32 - 8 * byte);
}

// Four pixels of the image; 255 in the third word's where there is one.
void load(ivec2 at, out uint four, out uint usable, out uint inside) {
    four = usable = inside = 0u;
    if (any(lessThan(at, ivec2(0))) || at.x >= push.width || at.y >= push.height) return;
    inside = at.x + 4 <= push.width ? ~0u : (1u << (8 * (push.width - at.x))) - 1u;
    const int byte = at.y * push.stride + at.x, word = byte >> 2;
    four = bytes_from(source[word], source[word + 1], byte & 3) & inside;
    usable = inside;
    if (given.mask == 0) return;
    const uint m = bytes_from(mask[word], mask[word + 1], byte & 3);
    usable &= ((((m & 0x7f7f7f7fu) + 0x7f7f7f7fu) | m) >> 7 & 0x01010101u) * 255u;
}

void sum_run(int line[kReach], out int sums[kRun]) {
    int sum = 0;
    [[unroll]] for (int i = 0; i < 2 * kInpaintRadius; ++i) sum += line[i];
    [[unroll]] for (int i = 0; i < kRun; ++i) {
        sum += line[i + 2 * kInpaintRadius];
        sums[i] = sum;
        sum -= line[i];
    }
}

// Inpaints the words of the tile.
void inpaint(ivec2 tile, int me) {
    for (int i = me; i < kSide * (kSide / 4); i += kInvocations) {
        const int row = i / (kSide / 4), column = i % (kSide / 4) * 4;
        uint four, usable, inside;
        load(tile - kInpaintRadius + ivec2(column, row), four, usable, inside);
        [[unroll]] for (int k = 0; k < 4; ++k) cells[row][column + k] =
            (usable >> (8 * k) & 1u) == 0u ? 0 : kOne + int(four >> (8 * k) & 255u);
    }
    barrier();
    int line[kReach], sums[kRun];
    for (int i = me; i < kSide * (kTile / kRun); i += kInvocations) {
        const int row = i % kSide, column = i / kSide * kRun;
        [[unroll]] for (int u = 0; u < kReach; ++u) line[u] = cells[row][column + u];
        sum_run(line, sums);
        [[unroll]] for (int u = 0; u < kRun; ++u) row_sums[row][column + u] = sums[u];
    }
    barrier();
    for (int i = me; i < kTile * (kTile / kRun); i += kInvocations) {
        const int x = i % kTile, y = i / kTile * kRun;
        [[unroll]] for (int v = 0; v < kReach; ++v) line[v] = row_sums[y + v][x];
        sum_run(line, sums);
        [[unroll]] for (int v = 0; v < kRun; ++v) cells[y + v][x] = sums[v];
    }
    barrier();
    for (int i = me; i < kWords; i += kInvocations) {
        const int row = i / (kTile / 4), word = i % (kTile / 4);
        const uint here = masked[row][word];
        uint four = rows[row][word] & ~here;
        for (int k = 0; k < 4; ++k) {
            if ((here >> (8 * k) & 1u) == 0u) continue;
            const int sums_here = cells[row][4 * word + k], sum = sums_here & (kOne - 1),
                      n = sums_here >> 20;
            four |= uint(n == 0 ? 128 : (2 * sum + n) / (2 * n)) << (8 * k);
        }
        rows[row][word] = four;
    }
    barrier();
}

// The bytes of four words, of rows that follow one another, by columns.
uvec4 transposed(uvec4 block) {
    uvec4 columns;
    [[unroll]] for (int k = 0; k < 4; ++k) {
        const uvec4 bytes = block >> (8 * k) & 255u;
        columns[k] = bytes.x | bytes.y << 8 | bytes.z << 16 | bytes.w << 24;
    }
    return columns;
}

// Column words of a block of 4 x 4 pixels, which has so many rows inside the image.
uvec4 column_words(int row, int word, int height) {
    uvec4 block;
    [[unroll]] for (int k = 0; k < 4; ++k) block[k] = rows[row + k][word];
    const uint inside = height >= 4 ? ~0u : (1u << (8 * height)) - 1u;
    return (transposed(block) ^ 0x80808080u) & inside;
}

// Sums of two pixels beside each other, 16 bits each.
uint pair_sums(uint four) { return (four & 0xff00ffu) + (four >> 8 & 0xff00ffu); }

void halve(ivec2 tile, int me) {
    if (!is_task(me, kHalf * (kHalf / 4))) return;
    const int row = me / (kHalf / 4), word = me % (kHalf / 4);
    uint four = 0u, unusable = 0u;
    [[unroll]] for (int k = 0; k < 2; ++k) {
        const uint sums = pair_sums(rows[2 * row][2 * word + k]) +
                          pair_sums(rows[2 * row + 1][2 * word + k]) + 0x020002u;
        const uint two = sums >> 2 & 0xff00ffu;
        four |= (two | two >> 8) << (16 * k) & (0xffffu << (16 * k));
        const uint all = masked[2 * row][2 * word + k] | masked[2 * row + 1][2 * word + k];
        unusable |= ((all & 0xffffu) != 0u ? 1u : 0u) << (2 * k) | (all >> 16 != 0u ? 2u : 0u)
                                                                       << (2 * k);
    }
    rows[kTile + row][word] = four;
    const int y = tile.y / 2 + row;
    if ((row & 1) != 0 || y >= push.half_height) return;
    [[unroll]] for (int k = 0; k < 4; ++k) {
        const int x = tile.x / 2 + 4 * word + k;
        if (x >= push.half_width) continue;
        half_mask[y / 2 * push.half_width + x] = uint8_t(1u - (unusable >> k & 1u));
        if (kRight) right_keys[y / 2 * push.half_width + x] = 0;
    }
}

// Four pixels of a row of `rows` from x on, read clamped; the row begins at pixel `first`.
uint row_word(int row, int first, int x, int width) {
    const int end = clamp(width - x, 0, 4), edge = x < 0 ? 0 : min(width - 1 - first, kTile - 1);
    const uint inside = x < 0      ? 0u
                        : end == 4 ? ~0u
                                   : (1u << (8 * end)) - 1u,
               nearest = (rows[row][edge >> 2] >> (8 * (edge & 3)) & 255u) * 0x01010101u;
    return (rows[row][clamp((x - first) >> 2, 0, kTile / 4 - 1)] & inside) | (nearest & ~inside);
}

// The words of the tile, and whether pixels of it are masked.
void load_tile(ivec2 tile, int me) {
    if (me == 0) any_masked = 0;
    barrier();
    [[unroll]] for (int t = 0; t < kWords / kInvocations; ++t) {
        const int i = me + t * kInvocations, row = i / (kTile / 4), word = i % (kTile / 4);
        uint four, usable, inside;
        load(tile + ivec2(4 * word, row), four, usable, inside);
        rows[row][word] = four;
        masked[row][word] = inside & ~usable;
        if (usable != inside) atomicOr(any_masked, 1);
    }
    barrier();
}

void give_gray(ivec2 tile, int me) {
    for (int i = me; i < kTile * kTile; i += kInvocations) {
        const int x = tile.x + i % kTile, y = tile.y + i / kTile;
        if (x < push.width && y < push.height)
            gray[y * push.width + x] =
                uint8_t(rows[i / kTile][i % kTile / 4] >> (8 * (i & 3)) & 255u);
    }
}

// The words of the image as the search reads it.
void give_words(ivec2 tile, int me) {
    if (kRight) {
        const int row_words = row_words_of(push.width);
        const int tasks = kTile * (kTile / 4 + 2);
        [[unroll]] for (int t = 0; t < rounds(tasks); ++t) {
            const int i = me + t * kInvocations, row = i / (kTile / 4 + 2), y = tile.y + row,
                      x = tile.x + 4 * (i % (kTile / 4 + 2)) - 4;
            const bool own = x < tile.x ? x < 0 : x < tile.x + kTile || x >= push.width;
            if (!is_task(i, tasks) || !own || x / 4 + 1 >= row_words || y >= push.height) continue;
            const int at = 2 * (y * row_words + x / 4 + 1);
            const uint four = row_word(row, tile.x, x, push.width);
            words[at] = four;
            if (x >= 0) words[at - 1] = four;
        }
    } else if (is_task(me, kWords / 4)) {
        const int y = tile.y + me / (kTile / 4) * 4, x = tile.x + me % (kTile / 4) * 4;
        if (x < push.width && y < push.height) {
            const uvec4 columns = column_words(y - tile.y, (x - tile.x) / 4, push.height - y);
            [[unroll]] for (int k = 0; k < 4; ++k) if (x + k < push.width)
                words[y / 4 * push.width + x + k] = columns[k];
        }
    }
}

// Likewise of the half image.
void give_half_words(ivec2 half_tile, int me) {
    if (half_tile.x >= push.half_width || half_tile.y >= push.half_height) return;
    if (me < (kHalf / 4) * (kHalf / 4)) {
        const int y = half_tile.y + me / (kHalf / 4) * 4, x = half_tile.x + me % (kHalf / 4) * 4;
        if (x < push.half_width && y < push.half_height) {
            const uvec4 columns =
                column_words(kTile + y - half_tile.y, (x - half_tile.x) / 4, push.half_height - y);
            [[unroll]] for (int k = 0; k < 4; ++k) if (x + k < push.half_width)
                half_columns[y / 4 * push.half_width + x + k] = columns[k];
        }
    }
    if (!kRight) return;
    const int row_words = row_words_of(push.half_width);
    for (int i = me; i < kHalf * (kHalf / 4 + 2); i += kInvocations) {
        const int row = i / (kHalf / 4 + 2), y = half_tile.y + row,
                  x = half_tile.x + 4 * (i % (kHalf / 4 + 2)) - 4;
        const bool own = x < half_tile.x ? x < 0 : x < half_tile.x + kHalf || x >= push.half_width;
        if (!own || x / 4 + 1 >= row_words || y >= push.half_height) continue;
        const int at = 2 * (y * row_words + x / 4 + 1);
        const uint four = row_word(kTile + row, half_tile.x, x, push.half_width);
        half_rows[at] = four;
        if (x >= 0) half_rows[at - 1] = four;
    }
}

void main() {
    const ivec2 tile = ivec2(gl_WorkGroupID.xy) * kTile;
    const int me = int(gl_LocalInvocationIndex);
    load_tile(tile, me);
    if (any_masked != 0) inpaint(tile, me);
    halve(tile, me);
    if (is_given(kRight ? kOutRightGray : kOutLeftGray)) give_gray(tile, me);
    give_words(tile, me);
    barrier();
    give_half_words(tile / 2, me);
}
