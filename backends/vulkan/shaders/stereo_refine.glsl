// Stage stereo, sections 8 to 10, but for the sums over windows: what the shaders that refine
// share.
#include "stereo.glsl"
#include "stereo_evidence.glsl"
#include "stereo_smooth.glsl"

layout(constant_id = 0) const int kRadius = 4;
layout(constant_id = 1) const bool kHalf = false;
layout(std430, set = 0, binding = 0) readonly buffer LeftColumns { int left_columns[]; };
layout(std430, set = 0, binding = 1) readonly buffer RightRows { uint64_t right_rows[]; };
layout(std430, set = 0, binding = 2) readonly buffer Field {
    int16_t field[];
};  // of half resolution: dense, or refined
// Half resolution only.
layout(std430, set = 0, binding = 3) writeonly buffer Moved { int16_t moved_field[]; };
// Full resolution only.
layout(std430, set = 0, binding = 4) readonly buffer LeftMask { uint8_t left_mask[]; };
layout(std430, set = 0, binding = 5) readonly buffer RightMask { uint8_t right_mask[]; };
layout(std430, set = 0, binding = 6) readonly buffer Standing { uint8_t standing[]; };
layout(std430, set = 0, binding = 7) writeonly buffer Evidence { uint evidence[]; };
layout(std430, set = 0, binding = 8) writeonly buffer HalfRefined { int16_t half_refined[]; };
layout(std430, set = 0, binding = 9) writeonly buffer Hypothesis { int16_t hypothesis[]; };
layout(std430, set = 0, binding = 10) writeonly buffer Refined { int16_t refined[]; };
layout(std430, set = 0, binding = 11) writeonly buffer Score { int16_t score[]; };

ivec2 size() {
    return kHalf ? ivec2(push.half_width, push.half_height) : ivec2(push.width, push.height);
}
// A disparity of full resolution, from the field's sample near the pixel and those beyond it in x,
// in y and in both, with the eighths that the near one has in x and in y.
int between(ivec4 four, int p, int q) {
    const int a = four.x, b = four.y, c = four.z, d = four.w;
    const int highest = max(max(a, b), max(c, d)), lowest = min(min(a, b), min(c, d));
    if (highest - lowest > kUpsampleRange)
        return 2 * (q >= 4 ? (p >= 4 ? a : b) : (p >= 4 ? c : d));
    const int change = (8 - p) * q * (b - a) + p * (8 - q) * (c - a) + (8 - p) * (8 - q) * (d - a);
    return a == kNoDisparity ? kNoDisparity : 2 * a + ((change + 16) >> 5);
}

// Four pixels of a row of the right image from j - 1 on, read clamped.
ivec4 right_at(int j, int y, int row_words) {
    const int byte = clamp(j, -3, size().x) + 3;
    const uint four = uint(right_rows[y * row_words + (byte >> 2)] >> (8 * (byte & 3)));
    return ivec4(uvec4(four, four >> 8, four >> 16, four >> 24) & 255u);
}

struct Sample {
    int hypothesis, disparity, score;
    bool peak;
};

Sample refine(int guess, ivec3 z) {
    Sample result = Sample(guess, guess, 0, false);
    if (guess == kNoDisparity) return result;
    result.score = max(z.x, max(z.y, z.z)) >> 8;
    const int bend = 2 * z.y - z.x - z.z;
    if (bend <= 0) return result;
    const int top = floor_divide(16 * (z.x - z.z) + bend, 2 * bend);
    result.peak = abs(top) <= 16;
    result.disparity = clamp(guess + clamp(top, -16, 16), 0, kMaxDisparity);
    return result;
}

// What is known of a sample before it is refined.
struct Known {
    int standing;
    bool usable;
};
Known known_of(int i, int j) {
    return Known(int(standing[min(j, push.half_height - 1) / 2 * push.half_samples_x +
                              min(i, push.half_width - 1) / 2]),
                 given.left_mask == 0 || int(left_mask[2 * (j * push.stride + i)]) != 0);
}

void classify(Sample given_sample, Known known, int i, int j, bool textured) {
    const int at = j * push.samples_x + i, x = 2 * i, row = 2 * j * push.stride;
    if (is_given(kOutRefined)) refined[at] = int16_t(given_sample.disparity);
    if (is_given(kOutScore)) score[at] = int16_t(given_sample.score);
    const bool settled = known.standing == kSettled;
    uint word = no_evidence(given_sample.hypothesis);
    if (given_sample.hypothesis != kNoDisparity && known.usable && known.standing != kDoubtful) {
        const int q = 16 * x - given_sample.disparity;
        bool good = given_sample.peak && q >= 0 &&
                    given_sample.score >= (settled ? kTrustedScore : push.refine_score) && textured;
        if (good && given.mask != 0) good = int(right_mask[row + ((q + 8) >> 4)]) != 0;
        if (good || settled)
            word = evidence_of(
                given_sample.hypothesis,
                good ? given_sample.disparity - given_sample.hypothesis : 0,
                clamp(good ? given_sample.score >> 4 : given_sample.score >> 5, 1, 255));
    }
    evidence[at] = word;
}
