// Stage stereo, section 8: refinement; at full resolution also the hypothesis of section 9, from
// the field of half resolution that it smooths, and the classification of section 10. A work group
// has a tile of 96 x 16 pixels. Each invocation goes down two columns of the right image seen
// through the hypothesis and sums along them; then it adds up the columns for six samples of a row.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo_refine.glsl"
layout(local_size_x = 64) in;

const int kInvocations = 64, kTileWidth = 96, kTileHeight = 16;
const int kColumns = kTileWidth / 2, kRows = kTileHeight / 2;  // of samples
// The windows of sample s are the pairs of columns s to s + kRadius - 1 and the first column of the
// pair after, the first pair beginning at column -kRadius of the tile.
const int kPairs = kColumns + kRadius;
const int kRun = 6;  // samples of an invocation
// Pixels from a sample of the field to the next, and the field's samples in a tile with windows.
const int kApart = kHalf ? 2 : 4, kBefore = (kRadius + kApart - 1) / kApart + (kHalf ? 0 : 1),
          kFieldWidth = kTileWidth / kApart + 2 * kBefore + 1,
          kFieldHeight = kTileHeight / kApart + 2 * kBefore + 1;
const int kSmoothed = kHalf ? 0 : kHalfSmoothRadius;  // around these: what smoothing them needs
const int kCellsWidth = kFieldWidth + 2 * kSmoothed, kCellsHeight = kFieldHeight + 2 * kSmoothed;

// Sums along the columns, of the even rows: of both columns of a pair, and of its first one. With
// l, w the gray of the left image and W_k less their middle, 0 outside the image: l l and l;
// then for each k: w w and the lower 4 bits of w; l w and the upper bits of w.
const int kSums = 7;
shared int64_t columns[kSums][kPairs][kRows + 1];
shared int cells[kCellsHeight][kCellsWidth];
shared int rows[kHalf ? 1 : kCellsHeight][kFieldWidth];
shared int guesses[kRows][kColumns + 1];

ivec2 tile() { return ivec2(gl_WorkGroupID.xy) * ivec2(kTileWidth, kTileHeight); }

// The field around the tile into cells, read clamped; at full resolution smoothed first.
void load_field(int me) {
    const ivec2 first = tile() / kApart - kBefore,
                end = ivec2(push.half_samples_x, push.half_samples_y) - 1;
    for (int i = me; i < kCellsHeight * kCellsWidth; i += kInvocations) {
        const ivec2 place = ivec2(i % kCellsWidth, i / kCellsWidth), at = first - kSmoothed + place,
                    from = clamp(at, ivec2(0), end);
        cells[place.y][place.x] =
            kHalf || from == at ? int(field[from.y * push.half_samples_x + from.x]) : kNoDisparity;
    }
    barrier();
    if (kHalf) return;
    for (int i = me; i < kCellsHeight * kFieldWidth; i += kInvocations) {
        const int row = i / kFieldWidth, column = i % kFieldWidth;
        rows[row][column] = smoothed(cells[row][column], cells[row][column + 1],
                                     cells[row][column + 2], kHalfSmoothRange);
    }
    barrier();
    for (int i = me; i < kFieldHeight * kFieldWidth; i += kInvocations) {
        const ivec2 place = ivec2(i % kFieldWidth, i / kFieldWidth), at = first + place,
                    from = clamp(at, ivec2(0), end) - first;
        const int disparity = smoothed(rows[from.y][from.x], rows[from.y + 1][from.x],
                                       rows[from.y + 2][from.x], kHalfSmoothRange);
        cells[place.y][place.x] = disparity;
        const bool of_tile = place.x >= kBefore && place.x < kBefore + kTileWidth / kApart &&
                             place.y >= kBefore && place.y < kBefore + kTileHeight / kApart;
        if (is_given(kOutHalfRefined) && from == place && of_tile)
            half_refined[at.y * push.half_samples_x + at.x] = int16_t(disparity);
    }
    barrier();
}

int weight_of(int m) {
    return m < 2 ? kSampleWeight[1] : m == 2 ? kSampleWeight[2] : kSampleWeight[3];
}

void give_hypothesis(int me) {
    for (int i = me; i < kTileWidth * kTileHeight; i += kInvocations) {
        const ivec2 place = ivec2(i % kTileWidth, i / kTileWidth), at = tile() + place;
        if (any(greaterThanEqual(at, size()))) continue;
        const ivec2 m = place & 3, near = (place >> 2) + kBefore,
                    far = near + mix(ivec2(1), ivec2(-1), equal(m, ivec2(0)));
        const ivec4 four = ivec4(cells[near.y][near.x], cells[near.y][far.x], cells[far.y][near.x],
                                 cells[far.y][far.x]);
        hypothesis[at.y * push.width + at.x] =
            int16_t(between(four, weight_of(m.x), weight_of(m.y)));
    }
}

// What a pixel adds to the sums. Without a branch, so that loads need not wait for those before.
int[kSums] summands(int l, int guess, int x, int y, int row_words) {
    const bool inside = x >= 0 && x < size().x && y >= 0 && y < size().y;
    const int at = 16 * x - (guess == kNoDisparity ? 0 : guess), f = at & 15;
    const ivec4 r = right_at(at >> 4, clamp(y, 0, size().y - 1), row_words);
    const ivec3 w = inside ? ((16 * r.xyz + f * (r.yzw - r.xyz) + 4) >> 3) - 256 : ivec3(0);
    const ivec3 squares = w * w * 2048 + (w & 15), products = l * w * 2048 + (w >> 4);
    return int[](l * l * 8192 + l, squares.x, products.x, squares.y, products.y, squares.z,
                 products.z);
}

// The field's columns on both sides of both columns of pixels from x on, and the weights of the
// near.
struct FieldColumns {
    ivec2 near, far, weight;
};
FieldColumns field_columns(int x) {
    FieldColumns of;
    of.weight = ivec2(0);
    [[unroll]] for (int c = 0; c < 2; ++c) {
        const int u = (x + c) >> (kHalf ? 1 : 2), m = (x + c) & (kApart - 1);
        of.near[c] = u - tile().x / kApart + kBefore;
        of.far[c] = of.near[c] + (kHalf ? m : m == 0 ? -1 : 1);
        if (!kHalf) of.weight[c] = weight_of(m);
    }
    return of;
}

ivec4 field_row(int row, FieldColumns at) {
    return ivec4(cells[row][at.near.x], cells[row][at.near.y], cells[row][at.far.x],
                 cells[row][at.far.y]);
}

// The left words of both columns in the row of words that y lies in.
ivec2 left_words(int x, int y) {
    ivec2 words;
    [[unroll]] for (int c = 0; c < 2; ++c) {
        const bool inside = x + c >= 0 && x + c < size().x && y + 3 >= 0 && y < size().y;
        words[c] = inside ? left_columns[(y >> 2) * size().x + x + c] : 0;
    }
    return words;
}

// Keeps a guess for refinement, if the row of the even column is one of the tile's samples.
void keep_guess(int column, int row, int guess) {
    if ((row & 1) == 0 && row >= 0 && row < kTileHeight && column >= 0 && column < kTileWidth)
        guesses[row / 2][column / 2] = guess;
}

void sum_columns(int me) {
    if (me >= kPairs) return;
    const int row_words = row_words_of(size().x), x = tile().x - kRadius + 2 * me;
    const FieldColumns field_at = field_columns(x);
    int pair_of_rows[kRows + kRadius][kSums], single_of_rows[kRows + kRadius][kSums];
    int pair_sum[kSums], single_sum[kSums];
    [[unroll]] for (int s = 0; s < kSums; ++s) pair_sum[s] = single_sum[s] = 0;
    ivec2 words = ivec2(0);
    ivec4 before, here, after;  // rows of the field
    [[unroll]] for (int v = 0; v < kTileHeight + 2 * kRadius - 1; ++v) {
        const int row = v - kRadius, y = tile().y + row;
        if (v == 0 || (row & 3) == 0) words = left_words(x, y);
        const int m = row & (kApart - 1);
        if (v == 0 || m == 0) {
            const int at = (row >> (kHalf ? 1 : 2)) + kBefore;
            before = v > 0 ? here : kHalf ? ivec4(0) : field_row(at - 1, field_at);
            here = v > 0 ? after : field_row(at, field_at);
            after = field_row(at + 1, field_at);
        }
        const ivec4 beyond = m > 0 ? after : kHalf ? here : before;
        int both[kSums], first[kSums];
        [[unroll]] for (int c = 0; c < 2; ++c) {
            const ivec4 four = ivec4(here[c], here[c + 2], beyond[c], beyond[c + 2]);
            const int guess = kHalf ? (four.x + four.y + four.z + four.w + 2) >> 2
                                    : between(four, field_at.weight[c], weight_of(m));
            const int of[kSums] = summands(pixel(words[c], row & 3), guess, x + c, y, row_words);
            [[unroll]] for (int s = 0; s < kSums; ++s) {
                if (c == 0) first[s] = of[s];
                both[s] = c == 0 ? of[s] : both[s] + of[s];
            }
            if (((c + kRadius) & 1) == 0) keep_guess(2 * me - kRadius + c, row, guess);
        }
        // As the columns, the rows of a window are kRadius pairs and the first of the next one.
        const int t = v / 2, j = t - kRadius;
        if ((v & 1) == 0) {
            [[unroll]] for (int s = 0; s < kSums; ++s) {
                if (j >= 0) {
                    columns[s][me][j] =
                        packInt2x32(ivec2(pair_sum[s] + both[s], single_sum[s] + first[s]));
                    pair_sum[s] -= pair_of_rows[j][s];
                    single_sum[s] -= single_of_rows[j][s];
                }
                pair_of_rows[t][s] = both[s];
                single_of_rows[t][s] = first[s];
            }
        } else {
            [[unroll]] for (int s = 0; s < kSums; ++s) {
                pair_of_rows[t][s] += both[s];
                single_of_rows[t][s] += first[s];
                pair_sum[s] += pair_of_rows[t][s];
                single_sum[s] += single_of_rows[t][s];
            }
        }
    }
}

// Sums along columns, of squares, products and values, from how they are packed.
ivec3 left_sums(int two) {
    const int value = (two << 19) >> 19;
    return ivec3(int(uint(two - value) >> 13), 0, value);
}
ivec3 right_sums(int squares, int products) {
    const int upper = (products << 21) >> 21;
    return ivec3(int(uint(squares) >> 11), (products - upper) >> 11, (squares & 2047) + 16 * upper);
}

// Sums of I I, l I and I over the windows of the invocation's samples, I the left image for image 0
// (without products), else W_(image - 2).
void sum_windows(int image, int first, int j, out int squares[kRun], out int products[kRun],
                 out int values[kRun]) {
    ivec3 line[kRun + kRadius], singles[kRun], sum = ivec3(0);
    [[unroll]] for (int u = 0; u < kRun + kRadius; ++u) {
        ivec2 a = unpackInt2x32(columns[max(2 * image - 1, 0)][first + u][j]), b = a;
        if (image > 0) b = unpackInt2x32(columns[2 * image][first + u][j]);
        line[u] = image == 0 ? left_sums(a.x) : right_sums(a.x, b.x);
        if (u >= kRadius) singles[u - kRadius] = image == 0 ? left_sums(a.y) : right_sums(a.y, b.y);
    }
    [[unroll]] for (int u = 0; u < kRadius; ++u) sum += line[u];
    [[unroll]] for (int m = 0; m < kRun; ++m) {
        const ivec3 window = sum + singles[m];
        squares[m] = window.x;
        products[m] = window.y;
        values[m] = window.z;
        sum += line[m + kRadius] - line[m];
    }
}

void main() {
    const int me = int(gl_LocalInvocationIndex);
    load_field(me);
    if (!kHalf && is_given(kOutHypothesis)) give_hypothesis(me);
    sum_columns(me);
    barrier();

    const int place = me % (kColumns / kRun) * kRun, row = me / (kColumns / kRun);
    const ivec2 first = tile() + 2 * ivec2(place, row);
    if (any(greaterThanEqual(first, size()))) return;
    int squares[kRun], products[kRun], left_sum[kRun], sum[kRun], n[kRun], left_variance[kRun];
    float left_root[kRun];
    ivec3 z[kRun];
    sum_windows(0, place, row, squares, products, left_sum);
    [[unroll]] for (int m = 0; m < kRun; ++m) {
        const int x = first.x + 2 * m;
        n[m] = (min(x + kRadius, size().x - 1) - max(x - kRadius, 0) + 1) *
               (min(first.y + kRadius, size().y - 1) - max(first.y - kRadius, 0) + 1);
        left_variance[m] = n[m] * squares[m] - left_sum[m] * left_sum[m];
        left_root[m] = inverse_root(left_variance[m]) * 1048576.0;
    }
    [[unroll]] for (int image = 1; image < 4; ++image) {
        sum_windows(image, place, row, squares, products, sum);
        [[unroll]] for (int m = 0; m < kRun; ++m) {
            const float root = inverse_root(n[m] * squares[m] - sum[m] * sum[m]);
            precise const float scaled = float(n[m] * products[m] - left_sum[m] * sum[m]) * root;
            precise const float coefficient = scaled * left_root[m];
            z[m][image - 1] = int(coefficient);
        }
    }
    [[unroll]] for (int m = 0; m < kRun; ++m) {
        if (first.x + 2 * m >= size().x) continue;
        const Sample result = refine(guesses[row][place + m], z[m]);
        const ivec2 at = first / 2 + ivec2(m, 0);
        if (kHalf)
            moved_field[at.y * push.half_samples_x + at.x] = int16_t(result.disparity);
        else
            classify(result, known_of(at.x, at.y), at.x, at.y, has_texture(left_variance[m], n[m]));
    }
}
