// Stage stereo, section 11. Confidences are final here.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_8bit_storage : require
#extension GL_EXT_shader_16bit_storage : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_GOOGLE_include_directive : require
#include "stereo.glsl"
layout(constant_id = 0) const int kRadius = 6;
#include "stereo_windows.glsl"

layout(std430, set = 0, binding = 0) readonly buffer Evidence { int16_t evidence[]; };
layout(std430, set = 0, binding = 1) readonly buffer Hypothesis { int16_t hypothesis[]; };
layout(std430, set = 0, binding = 2) readonly buffer Confidence { uint8_t confidence[]; };
layout(std430, set = 0, binding = 3) writeonly buffer Filled { int16_t filled[]; };
layout(std430, set = 0, binding = 4) writeonly buffer GivenConfidence {
    uint8_t given_confidence[];
};

const int kOne =
    1 << 16;  // a cell counts its pixel above the sum of differences, which are at most 16

int cell(ivec2 at) {
    if (any(lessThan(at, ivec2(0))) || at.x >= push.width || at.y >= push.height) return 0;
    const int i = at.y * push.width + at.x, disparity = int(evidence[i]);
    return disparity == kNoDisparity ? 0 : kOne + disparity - int(hypothesis[i]);
}

void main() {
    const ivec2 first = first_of_run();
    const int side = 2 * kRadius + 1;
    int sums[kRun];
    sum_windows(sums);
    for (int j = 0; j < kRun; ++j) {
        const ivec2 at = first + ivec2(0, j);
        if (at.x >= push.width || at.y >= push.height) continue;
        const int i = at.y * push.width + at.x;
        const int m = (sums[j] + kOne / 2) >> 16, sum = sums[j] - m * kOne;
        int disparity = int(evidence[i]), sure = int(confidence[i]);
        if (disparity == kNoDisparity && 2 * m >= side * side) {
            disparity = max(0, int(hypothesis[i]) + floor_divide(2 * sum + m, 2 * m));
            sure = kFilledConfidence;
        }
        filled[i] = int16_t(disparity);
        if (given.confidence != 0) given_confidence[at.y * push.stride + at.x] = uint8_t(sure);
    }
}
