// Stage align, section 1: where each patch is expected, one invocation per patch; predict of
// backends/definition/align_math.hpp.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "motion.glsl"
#include "backends/stages/align.hpp"
#include "align_push.h"
layout(local_size_x = 64) in;

layout(std430, set = 0, binding = 0) readonly buffer Patches { Patch patches[]; };
layout(std430, set = 0, binding = 1) readonly buffer Slopes { PatchSlope slopes[]; };
layout(std430, set = 0, binding = 2) readonly buffer Motions { Motion motions[]; };
layout(std430, set = 0, binding = 3) writeonly buffer Predictions {
    PatchPrediction predictions[];
};
layout(push_constant) uniform Push {
    AlignConstants push;
    AlignRun run;
};

// The same motion with a real part of length 1; as it is where that has no length or is not finite.
DualQuaternion with_unit_rotation(DualQuaternion m) {
    if (abs(dot(m.real, m.real) - 1.0) <= kUnitTolerance) return m;
    DualQuaternion held = m;
    float squared;
    if (!hold_length(held, squared)) return m;
    const float scale = inversesqrt(squared);
    return DualQuaternion(scale * held.real, scale * held.dual);
}

PatchPrediction predict(int i) {
    const PatchPrediction none = PatchPrediction(0, 0, int[4](0, 0, 0, 0), 0, 0);
    DualQuaternion moved_by[4];
    for (int k = 0; k < 4; ++k)
        moved_by[k] = with_unit_rotation(load_motion(motions[patches[i].node[k]]));
    const DualQuaternion motion = blend(moved_by, patches[i].weight);
    const vec3 rest = load3(patches[i].position), moved = apply(motion, rest),
               p = moved - vec3(push.live_x, 0, 0);
    if (!finite(vec4(p, 0)) || !(p.z > kMinPatchDepthMm)) return none;
    const float fx = push.camera.fx / p.z, fy = push.camera.fy / p.z, x = p.x / p.z, y = p.y / p.z;
    const float u = push.camera.fx * x + push.live_cx, v = push.camera.fy * y + push.camera.cy;
    if (!(u >= push.margin && v >= push.margin && u <= push.max_x - push.margin &&
          v <= push.max_y - push.margin))
        return none;

    vec3 a = rotate(motion, load3(patches[i].tangent_u)),
         b = rotate(motion, load3(patches[i].tangent_v));
    for (int k = 0; k < 4; ++k) {
        const vec3 apart = apply(moved_by[k], rest) - moved;
        a += slopes[i].weight_u[k] * apart;
        b += slopes[i].weight_v[k] * apart;
    }
    const float j00 = fx * (a.x - x * a.z), j01 = fx * (b.x - x * b.z);
    const float j10 = fy * (a.y - y * a.z), j11 = fy * (b.y - y * b.z);
    if (!finite(vec4(j00, j01, j10, j11))) return none;
    // Not mirrored, and not stretched too much.
    const float det = j00 * j11 - j01 * j10;
    const float half_sum = 0.5 * (j00 * j00 + j01 * j01 + j10 * j10 + j11 * j11);
    if (half_sum > kMaxStretch2) return none;  // nor is the difference below infinite
    const float largest2 = half_sum + sqrt(max(half_sum * half_sum - det * det, 0.0));
    if (!(det > 0.0 && largest2 <= kMaxStretch2 && det * det >= kMinStretch2 * largest2))
        return none;

    const ivec4 inverse =
        ivec4(floor(float(kPatchMatrixOne) / det * vec4(j11, -j01, -j10, j00) + 0.5));
    return PatchPrediction(int(floor(u * float(kPatchOne) + 0.5)),
                           int(floor(v * float(kPatchOne) + 0.5)),
                           int[4](inverse.x, inverse.y, inverse.z, inverse.w), 1, 0);
}

void main() {
    const int i = int(gl_GlobalInvocationID.x);
    if (i < run.patches) predictions[i] = predict(i);
}
