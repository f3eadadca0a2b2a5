// Stage warp, one invocation per point.
#version 450
#extension GL_EXT_shader_16bit_storage : require
#extension GL_GOOGLE_include_directive : require
#include "records.glsl"
#include "motion.glsl"
layout(local_size_x = 64) in;

layout(std430, set = 0, binding = 0) readonly buffer Points { SurfacePoint points[]; };
layout(std430, set = 0, binding = 1) readonly buffer Motions { Motion motions[]; };
layout(std430, set = 0, binding = 2) readonly buffer Disparity { int16_t disparity[]; };
layout(std430, set = 0, binding = 3) writeonly buffer Samples { SurfaceSample samples[]; };

#define LIVE_DISPARITY(i) int(disparity[i])
#include "live_depth.glsl"

#include "backends/stages/warp.hpp"
layout(push_constant) uniform Push {
    WarpConstants push;
    DisparityGrid image;
};

uint observe(vec3 position, vec3 normal, out float residual) {
    residual = 0.0;
    vec2 pixel;
    if (!project_inside(push.camera, image, position, pixel)) return kOutside;
    const float depth = live_depth(push.camera, image, pixel);
    if (depth == 0.0) return kNoDepth;
    residual = depth - position.z;
    if (!(dot(normal, position) < 0.0)) return kInconsistent;
    if (abs(residual) <= push.tolerance_mm) return kObserved;
    return residual < 0.0 ? kOccluded : kInconsistent;
}

void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= push.points) return;
    DualQuaternion moved_by[4];
    for (int k = 0; k < 4; ++k) moved_by[k] = usable_motion(motions[points[i].node[k]]);
    const DualQuaternion motion = blend(moved_by, points[i].weight);
    const vec3 position = apply(motion, load3(points[i].position)),
               normal = rotate(motion, load3(points[i].normal));
    float residual;
    const uint observation = observe(position, normal, residual);
    samples[i] = SurfaceSample(store3(position), store3(normal), residual, observation);
}
