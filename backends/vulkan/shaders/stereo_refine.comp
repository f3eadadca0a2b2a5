// Stage stereo, section 8: refinement; at full resolution also the classification of section 10. A
// work group has a tile of 32 x 32 pixels: it makes the right image seen through the hypothesis,
// and then for the left image and each k sums along the columns of the windows and adds these up
// for 8 pixels of a row each.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo.glsl"
layout(local_size_x = 32,
       local_size_y = 5) in;  // the last row only helps with what comes before the rows

layout(constant_id = 0) const int kRadius = 4;
layout(constant_id = 1) const bool kHalf = false;
layout(std430, set = 0, binding = 0) readonly buffer Left { uint8_t left[]; };
layout(std430, set = 0, binding = 1) readonly buffer Right { uint8_t right[]; };
layout(std430, set = 0, binding = 2) readonly buffer Hypothesis { int16_t hypothesis[]; };
layout(std430, set = 0, binding = 3) writeonly buffer Result {
    int16_t result[];
};  // the refined field, or the evidence
// At full resolution only.
layout(std430, set = 0, binding = 4) readonly buffer LeftMask { uint8_t left_mask[]; };
layout(std430, set = 0, binding = 5) readonly buffer RightMask { uint8_t right_mask[]; };
layout(std430, set = 0, binding = 6) readonly buffer Standing { uint8_t standing[]; };
layout(std430, set = 0, binding = 7) writeonly buffer Confidence { uint8_t confidence[]; };
layout(std430, set = 0, binding = 8) writeonly buffer Refined { int16_t refined[]; };
layout(std430, set = 0, binding = 9) writeonly buffer Score { int16_t score[]; };

const int kTile = 32, kInvocations = 160, kSide = kTile + 2 * kRadius;
const int kRun = 8, kQuads = kRun / 4;  // pixels of an invocation, in vectors of four
const int kReach = kRun + 2 * kRadius;  // and with their windows

shared ivec2 cells[kSide][kSide];  // L, and W_-1, W_0, W_1 in 9 bits each; 0 outside the image
// Sums along the columns: of I I, 22 bits, and the lower 10 bits of that of I; of L I, 21 bits, and
// the upper bits of that of I.
shared uvec2 columns[kTile][kSide + 1];

uvec2 packed_sums(ivec3 sums) { return uvec2(sums.y | sums.x << 22, sums.z | sums.x >> 10 << 21); }
ivec3 unpacked_sums(uvec2 two) {
    return ivec3(two.x >> 22 | two.y >> 21 << 10, two.x & 0x3fffffu, two.y & 0x1fffffu);
}

ivec2 size() {
    return kHalf ? ivec2(push.half_width, push.half_height) : ivec2(push.width, push.height);
}

int right_at(int x, int y) { return int(right[y * size().x + clamp(x, 0, size().x - 1)]); }

void warp() {
    const ivec2 first = ivec2(gl_WorkGroupID.xy) * kTile - kRadius;
    for (int i = int(gl_LocalInvocationIndex); i < kSide * kSide; i += kInvocations) {
        const int column = i % kSide, row = i / kSide, x = first.x + column, y = first.y + row;
        int gray = 0, warped = 0;
        if (x >= 0 && x < size().x && y >= 0 && y < size().y) {
            const int at = y * size().x + x, guess = int(hypothesis[at]);
            const int p = 16 * x - (guess == kNoDisparity ? 0 : guess), j = p >> 4, f = p & 15;
            const ivec4 r =
                ivec4(right_at(j - 1, y), right_at(j, y), right_at(j + 1, y), right_at(j + 2, y));
            const ivec3 w = ((16 - f) * r.xyz + f * r.yzw + 4) >> 3;
            gray = int(left[at]);
            warped = w.x | w.y << 9 | w.z << 18;
        }
        cells[row][column] = ivec2(gray, warped);
    }
}

// The left image for image 0, else W_(image - 2).
int value_of(ivec2 cell, int image) {
    return image == 0 ? cell.x : (cell.y >> (9 * (image - 1))) & 511;
}

// Sums of I, I I and L I along the columns, I that image.
void sum_columns(int image) {
    for (int i = int(gl_LocalInvocationIndex); i < kSide * (kTile / kRun); i += kInvocations) {
        const int column = i % kSide, first = i / kSide * kRun;
        int gray[kReach], value[kReach];
        [[unroll]] for (int v = 0; v < kReach; ++v) {
            const ivec2 cell = cells[first + v][column];
            gray[v] = cell.x;
            value[v] = value_of(cell, image);
        }
        ivec3 sums = ivec3(0);
        [[unroll]] for (int v = 0; v < 2 * kRadius; ++v) sums +=
            ivec3(1, value[v], gray[v]) * value[v];
        [[unroll]] for (int v = 0; v < kRun; ++v) {
            sums +=
                ivec3(1, value[v + 2 * kRadius], gray[v + 2 * kRadius]) * value[v + 2 * kRadius];
            columns[first + v][column] = packed_sums(sums);
            sums -= ivec3(1, value[v], gray[v]) * value[v];
        }
    }
}

// Of I, I I and L I, over the windows of the invocation's pixels.
void sum_windows(out ivec4 values[kQuads], out ivec4 squares[kQuads], out ivec4 products[kQuads]) {
    const int y = int(gl_LocalInvocationID.x), x = kRun * int(gl_LocalInvocationID.y);
    uvec2 line[kReach];
    [[unroll]] for (int u = 0; u < kReach; ++u) line[u] = columns[y][x + u];
    ivec3 sums = ivec3(0);
    [[unroll]] for (int u = 0; u < 2 * kRadius; ++u) sums += unpacked_sums(line[u]);
    [[unroll]] for (int m = 0; m < kRun; ++m) {
        sums += unpacked_sums(line[m + 2 * kRadius]);
        values[m / 4][m % 4] = sums.x;
        squares[m / 4][m % 4] = sums.y;
        products[m / 4][m % 4] = sums.z;
        sums -= unpacked_sums(line[m]);
    }
}

struct Pixel {
    int hypothesis, disparity, score;
    bool peak;
};

Pixel refine(int guess, ivec3 z) {
    Pixel pixel = Pixel(guess, guess, 0, false);
    if (guess == kNoDisparity) return pixel;
    pixel.score = max(z.x, max(z.y, z.z)) >> 8;
    const int bend = 2 * z.y - z.x - z.z;
    if (bend <= 0) return pixel;
    const int top = floor_divide(16 * (z.x - z.z) + bend, 2 * bend);
    pixel.peak = abs(top) <= 16;
    pixel.disparity = clamp(guess + clamp(top, -16, 16), 0, 32000);
    return pixel;
}

void classify(Pixel pixel, int x, int y, bool textured) {
    const int at = y * push.width + x;
    if (given.refined != 0) refined[at] = int16_t(pixel.disparity);
    if (given.score != 0) score[at] = int16_t(pixel.score);
    const int stands = int(standing[min(y >> 1, push.half_height - 1) * push.half_width +
                                    min(x >> 1, push.half_width - 1)]);
    const bool known = stands == kSettled;
    const bool usable = given.left_mask == 0 || int(left_mask[y * push.stride + x]) != 0;
    int disparity = kNoDisparity, sure = 0;
    if (pixel.hypothesis != kNoDisparity && usable && stands != kDoubtful) {
        const int q = 16 * x - pixel.disparity;
        bool good = pixel.peak && q >= 0 &&
                    pixel.score >= (known ? kTrustedScore : push.refine_score) && textured;
        if (good && given.mask != 0) good = int(right_mask[y * push.stride + ((q + 8) >> 4)]) != 0;
        if (good || known) {
            disparity = good ? pixel.disparity : pixel.hypothesis;
            sure = clamp(good ? pixel.score >> 4 : pixel.score >> 5, 1, 255);
        }
    }
    result[at] = int16_t(disparity);
    confidence[at] = uint8_t(sure);
}

void main() {
    const bool scores = gl_LocalInvocationID.y < kTile / kRun;
    const ivec2 tile = ivec2(gl_WorkGroupID.xy) * kTile;
    const ivec2 place = ivec2(kRun * gl_LocalInvocationID.y, gl_LocalInvocationID.x),
                first = tile + place;
    const int window_height = min(first.y + kRadius, size().y - 1) - max(first.y - kRadius, 0) + 1;
    warp();
    barrier();

    ivec4 n[kQuads], left_sum[kQuads];
    vec4 left_root[kQuads];
    int textured = 0;  // a bit for each pixel
    ivec4 z[3][kQuads];
    for (int image = 0; image < 4; ++image) {
        sum_columns(image);
        barrier();
        if (scores) {
            ivec4 sum[kQuads], squares[kQuads], products[kQuads];
            sum_windows(sum, squares, products);
            [[unroll]] for (int v = 0; v < kQuads; ++v) {
                if (image == 0) {
                    const ivec4 x = first.x + 4 * v + ivec4(0, 1, 2, 3);
                    n[v] =
                        (min(x + kRadius, size().x - 1) - max(x - kRadius, 0) + 1) * window_height;
                }
                const ivec4 variance = n[v] * squares[v] - sum[v] * sum[v];
                const vec4 root = inverse_roots(variance);
                if (image == 0) {
                    left_sum[v] = sum[v];
                    left_root[v] = root * 1048576.0;
                    if (!kHalf) [[unroll]]
                        for (int m = 0; m < 4; ++m)
                            textured |= has_texture(variance[m], n[v][m]) ? 1 << (4 * v + m) : 0;
                } else {
                    precise const vec4 scaled =
                        vec4(n[v] * products[v] - left_sum[v] * sum[v]) * root;
                    precise const vec4 coefficient = scaled * left_root[v];
                    if (image == 1) z[0][v] = ivec4(coefficient);
                    if (image == 2) z[1][v] = ivec4(coefficient);
                    if (image == 3) z[2][v] = ivec4(coefficient);
                }
            }
        }
        barrier();
    }

    if (scores) [[unroll]]
        for (int m = 0; m < kRun; ++m) {
            cells[place.y][place.x + m] =
                ivec2(2 * z[0][m / 4][m % 4] + ((textured >> m) & 1), z[1][m / 4][m % 4]);
            columns[place.y][place.x + m].x = z[2][m / 4][m % 4];
        }
    barrier();
    for (int i = int(gl_LocalInvocationIndex); i < kTile * kTile; i += kInvocations) {
        const int row = i / kTile, column = i % kTile;
        const ivec2 at = tile + ivec2(column, row);
        if (at.x >= size().x || at.y >= size().y) continue;
        const ivec3 three = ivec3(cells[row][column], columns[row][column].x);
        const int guess = int(hypothesis[at.y * size().x + at.x]);
        const Pixel pixel = refine(guess, ivec3(three.x >> 1, three.yz));
        if (kHalf)
            result[at.y * size().x + at.x] = int16_t(pixel.disparity);
        else
            classify(pixel, at.x, at.y, (three.x & 1) != 0);
    }
}
