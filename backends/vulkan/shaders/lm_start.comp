// Stage lm: where every control point starts, as the first trial.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "lm.glsl"
layout(local_size_x = kNodeGroup) in;

layout(std430, set = 0, binding = 0) readonly buffer Motions { Motion motions[]; };
layout(std430, set = 0, binding = 1) readonly buffer Rest { vec4 rest[]; };
layout(std430, set = 0, binding = 2) readonly buffer Rigid {
    vec4 rigid[2];
};  // of presolve: rotation, translation
layout(std430, set = 0, binding = 3) writeonly buffer Trial { vec4 trial[]; };

void main() {
    const uint i = gl_GlobalInvocationID.x;
    if (i >= push.nodes) return;
    const vec3 at = rest[i].xyz;
    DualQuaternion motion = usable_motion(motions[i]);
    vec3 position = apply(motion, at);
    if ((run.given & kPresolve) != 0) {
        position = rotate(rigid[0], position) + rigid[1].xyz;
        const vec4 rotation = multiply(rigid[0], motion.real);
        motion = from_rigid(rotation, position - rotate(rotation, at));
    }
    trial[kNodeVectors * i] = motion.real;
    trial[kNodeVectors * i + 1] = motion.dual;
    trial[kNodeVectors * i + 2] = vec4(position, 0);
}
