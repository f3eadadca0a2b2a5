// Stage stereo, section 8: refinement; at full resolution also sections 9 and 10, as
// stereo_refine.comp, for devices that run many invocations at once. A work group has a tile of
// 16 x 8 samples. First it makes pairs of rows of the right image seen through the hypothesis, then
// sums along the columns of windows, then a sample's windows for each invocation.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo_refine.glsl"
const int kInvocations = 256;
layout(local_size_x = kInvocations) in;

const int kTileWidth = kWideRefineWidth, kTileHeight = kWideRefineHeight;
// A window is kRadius whole pairs, of which the first row is odd in the image, and a row of its
// own: above them for an even radius, below for an odd one.
const int kAbove = 1 - (kRadius & 1);
const int kColumns = 2 * kTileWidth - 1 + 2 * kRadius, kPairs = kTileHeight + kRadius;
const int kFirstRow = -kRadius - kAbove;  // of the first pair, from the tile's
const int kRun = 2;                 // rows of samples whose windows' columns an invocation sums
const int kTaken = kRun + kRadius;  // pairs that these have
// The field's samples round the pixels of a tile, of which so many lie before those in it.
const int kBefore = kHalf ? (kRadius + 1) / 2 : 2,
          kCellsWidth = (kHalf ? kTileWidth : kTileWidth / 2) + 2 * kBefore,
          kCellsHeight = (kHalf ? kTileHeight : kTileHeight / 2) + 2 * kBefore;

// The right image seen through the hypothesis one pixel to the left, on the spot and one to the
// right, and left gray; a row in each half. 0 outside the image.
shared ivec4 pairs[kPairs][kColumns];
// Sums along the windows' columns, two side by side, of L and L L; and of W, W W and L W for each
// of the three W.
const int kPlanes = 11;
shared ivec2 columns[kPlanes][kTileHeight][(kColumns + 1) / 2];
shared int cells[kCellsHeight][kCellsWidth];
shared int guesses[kTileHeight][kTileWidth];

ivec2 tile() { return ivec2(gl_WorkGroupID.xy) * ivec2(kTileWidth, kTileHeight); }

int field_at(ivec2 at) {
    const ivec2 end = ivec2(push.half_samples_x, push.half_samples_y) - 1,
                from = clamp(at, ivec2(0), end);
    const int disparity = int(field[from.y * push.half_samples_x + from.x]);
    return kHalf || from == at ? disparity : kNoDisparity;
}

int smoothed_at(ivec2 at) {
    int rows[3];
    [[unroll]] for (int v = 0; v < 3; ++v) {
        const ivec2 middle = at + ivec2(0, v - 1);
        rows[v] = smoothed(field_at(middle - ivec2(1, 0)), field_at(middle),
                           field_at(middle + ivec2(1, 0)), kHalfSmoothRange);
    }
    return smoothed(rows[0], rows[1], rows[2], kHalfSmoothRange);
}

// The field round the tile, read clamped; at full resolution smoothed first.
void load_field(int me) {
    const ivec2 first = (kHalf ? tile() : tile() / 2) - kBefore,
                end = ivec2(push.half_samples_x, push.half_samples_y) - 1;
    for (int i = me; i < kCellsHeight * kCellsWidth; i += kInvocations) {
        const ivec2 place = ivec2(i % kCellsWidth, i / kCellsWidth), at = first + place,
                    from = clamp(at, ivec2(0), end);
        cells[place.y][place.x] = kHalf ? field_at(at) : smoothed_at(from);
        const ivec2 inside = place - kBefore;
        if (!kHalf && is_given(kOutHalfRefined) && from == at &&
            all(greaterThanEqual(inside, ivec2(0))) &&
            all(lessThan(inside, ivec2(kTileWidth, kTileHeight) / 2)))
            half_refined[at.y * push.half_samples_x + at.x] = int16_t(cells[place.y][place.x]);
    }
}

// At the pixel (x, y) from the tile's first, of an odd row, and at the one below it.
ivec2 guesses_at(int x, int y) {
    if (kHalf) {
        const int u = (x >> 1) + kBefore, u2 = ((x + 1) >> 1) + kBefore,
                  v = max((y >> 1) + kBefore, 0), v2 = ((y + 1) >> 1) + kBefore;
        const int above = cells[v][u] + cells[v][u2], below = cells[v2][u] + cells[v2][u2];
        return ivec2((above + below + 2) >> 2, (below + 1) >> 1);
    }
    // Samples lie between the rows 4 v and 4 v + 1, so that both pixels have the same four.
    const int u = ((x - 1) >> 2) + kBefore, v = ((y - 1) >> 2) + kBefore, p = 7 - 2 * ((x - 1) & 3),
              q = 7 - 2 * ((y - 1) & 3);
    const ivec4 four = ivec4(cells[v][u], cells[v][u + 1], cells[v + 1][u], cells[v + 1][u + 1]);
    return ivec2(between(four, p, q), between(four, p, q - 2));
}

int packed(ivec2 rows) { return (rows.x & 0xffff) | rows.y << 16; }
ivec2 unpacked(int rows) { return ivec2((rows << 16) >> 16, rows >> 16); }

void make_pairs(int me) {
    const ivec2 end = size() - 1;
    const int row_words = row_words_of(size().x);
    for (int i = me; i < kPairs * kColumns; i += kInvocations) {
        const int column = i % kColumns, pair = i / kColumns, tile_x = column - kRadius,
                  tile_y = kFirstRow + 2 * pair;
        const ivec2 guess = guesses_at(tile_x, tile_y);
        if (tile_x >= 0 && tile_x < 2 * kTileWidth && (tile_x & 1) == 0 && tile_y >= -1 &&
            tile_y < 2 * kTileHeight - 1)
            guesses[(tile_y + 1) / 2][tile_x / 2] = guess.y;
        const ivec2 at = 2 * tile() + ivec2(tile_x, tile_y);
        ivec3 rows[2];
        ivec2 left;
        [[unroll]] for (int k = 0; k < 2; ++k) {
            const ivec2 pixel_at = at + ivec2(0, k), from = clamp(pixel_at, ivec2(0), end);
            const bool inside = pixel_at == from;
            const int through = 16 * from.x - max(guess[k], 0), f = through & 15;
            const ivec4 r = right_at(through >> 4, from.y, row_words);
            const int word = left_columns[(from.y >> 2) * size().x + from.x];
            rows[k] = inside ? (16 * r.xyz + f * (r.yzw - r.xyz) + 4) >> 3 : ivec3(0);
            left[k] = inside ? pixel(word, from.y & 3) : 0;
        }
        pairs[pair][column] =
            ivec4(packed(ivec2(rows[0].x, rows[1].x)), packed(ivec2(rows[0].y, rows[1].y)),
                  packed(ivec2(rows[0].z, rows[1].z)), packed(left));
    }
}

// A plane's sums in a column of the windows of kRun rows of samples, from what is in the rows of
// the pairs that they have.
void give_column(int plane, int row, int column, ivec2 rows[kTaken]) {
    int sum = 0;
    [[unroll]] for (int q = kAbove; q < kAbove + kRadius; ++q) sum += rows[q].x + rows[q].y;
    [[unroll]] for (int s = 0; s < kRun; ++s) {
        const int own = kAbove == 1 ? rows[s].y : rows[s + kRadius].x;
        columns[plane][row + s][column >> 1][column & 1] = sum + own;
        if (s == kRun - 1) break;
        const int q = s + kAbove;
        sum += rows[q + kRadius].x + rows[q + kRadius].y - rows[q].x - rows[q].y;
    }
}

void sum_columns(int me) {
    for (int i = me; i < kColumns * (kTileHeight / kRun); i += kInvocations) {
        const int column = i % kColumns, row = i / kColumns * kRun;
        ivec2 left[kTaken], of[kTaken], result[kTaken];
        [[unroll]] for (int q = 0; q < kTaken; ++q) {
            left[q] = unpacked(pairs[row + q][column].w);
            result[q] = left[q] * left[q];
        }
        give_column(0, row, column, left);
        give_column(1, row, column, result);
        // Once more for each image costs more than the loop: the code is long enough.
        [[dont_unroll]] for (int k = 0; k < 3; ++k) {
            [[unroll]] for (int q = 0; q < kTaken; ++q) of[q] = unpacked(pairs[row + q][column][k]);
            give_column(3 * k + 2, row, column, of);
            [[unroll]] for (int q = 0; q < kTaken; ++q) result[q] = of[q] * of[q];
            give_column(3 * k + 3, row, column, result);
            [[unroll]] for (int q = 0; q < kTaken; ++q) result[q] = of[q] * left[q];
            give_column(3 * k + 4, row, column, result);
        }
    }
}

int sum_window(int plane, int row, int column) {
    int sum = columns[plane][row][column + kRadius].x;
    [[unroll]] for (int u = 0; u < kRadius; ++u) {
        const ivec2 two = columns[plane][row][column + u];
        sum += two.x + two.y;
    }
    return sum;
}

void main() {
    const int me = int(gl_LocalInvocationIndex);
    const ivec2 place = ivec2(me % kTileWidth, me / kTileWidth), at = tile() + place,
                first = 2 * at;
    const bool has_sample = place.y < kTileHeight && all(lessThan(first, size()));
    Known known;
    if (!kHalf && has_sample) known = known_of(at.x, at.y);  // long before it is needed
    load_field(me);
    barrier();
    make_pairs(me);
    if (!kHalf && is_given(kOutHypothesis))
        for (int i = me; i < 2 * kTileWidth * (kTileHeight + 1); i += kInvocations) {
            const int x = i % (2 * kTileWidth), y = i / (2 * kTileWidth) * 2 - 1;
            const ivec2 two = guesses_at(x, y), at = 2 * tile() + ivec2(x, y);
            [[unroll]] for (int k = 0; k < 2; ++k) if (y + k >= 0 && y + k < 2 * kTileHeight &&
                                                       at.x < push.width && at.y + k < push.height)
                hypothesis[(at.y + k) * push.width + at.x] = int16_t(two[k]);
        }
    barrier();
    sum_columns(me);
    barrier();

    if (!has_sample) return;
    // Products may wrap round; their differences fit.
    const int n = (min(first.x + kRadius, size().x - 1) - max(first.x - kRadius, 0) + 1) *
                  (min(first.y + kRadius, size().y - 1) - max(first.y - kRadius, 0) + 1);
    const int left_sum = sum_window(0, place.y, place.x),
              left_variance = n * sum_window(1, place.y, place.x) - left_sum * left_sum;
    const float left_root = inverse_root(left_variance) * 1048576.0;
    ivec3 z = ivec3(0);
    [[dont_unroll]] for (int k = 0; k < 3; ++k) {
        const int sum = sum_window(3 * k + 2, place.y, place.x),
                  squares = sum_window(3 * k + 3, place.y, place.x),
                  products = sum_window(3 * k + 4, place.y, place.x);
        const float root = inverse_root(n * squares - sum * sum);
        precise const float scaled = float(n * products - left_sum * sum) * root;
        precise const float coefficient = scaled * left_root;
        z = ivec3(z.yz, int(coefficient));
    }
    const Sample result = refine(guesses[place.y][place.x], z);
    if (kHalf)
        moved_field[at.y * push.half_samples_x + at.x] = int16_t(result.disparity);
    else
        classify(result, known, at.x, at.y, has_texture(left_variance, n));
}
