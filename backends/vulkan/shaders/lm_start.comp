// Stage lm: where every control point starts, without a rigid motion first.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "lm.glsl"
layout(local_size_x = kNodeGroup) in;

layout(std430, set = 0, binding = 0) readonly buffer Motions { Motion motions[]; };
layout(std430, set = 0, binding = 1) readonly buffer Rest { vec4 rest[]; };
layout(std430, set = 0, binding = 2) writeonly buffer Trial { vec4 trial[]; };
#include "lm_start.glsl"

void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i < push.nodes) start(i);
}
