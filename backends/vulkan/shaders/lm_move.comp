// Stage lm: ends the conjugate gradients, and moves the control points by the step to the next
// trial, one invocation each; or to the results, by a last step that is trusted.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "lm.glsl"
#include "lm_blocks.glsl"
#include "lm_gradients.glsl"

layout(std430, set = 0, binding = 4) readonly buffer Rest { vec4 rest[]; };
layout(std430, set = 0, binding = 5) readonly buffer Present { vec4 present[]; };
layout(std430, set = 0, binding = 6) writeonly buffer Trial { vec4 trial[]; };
layout(std430, set = 0, binding = 7) writeonly buffer Moves { LmMove moves[]; };
layout(std430, set = 0, binding = 8) readonly buffer Given { Motion motions[]; };
layout(std430, set = 0, binding = 9) writeonly buffer Results { Motion results[]; };
layout(std430, set = 0, binding = 10) writeonly buffer Summary { LmSummary summary; };
#include "lm_decide.glsl"
#include "lm_result.glsl"

shared LmMove shares[kNodeGroup];  // as many as kBlockGroup

// The solution, half a control point's. Without conjugate gradients it is M^-1 r at the start.
vec3 solution(LmGradients by, float beta, uint i, uint h) {
    if (run.step == 0) return vectors[passed_vector(1, i, kConditioned, h)].xyz;
    const vec3 before = vectors[own_vector(i, kSolution, h)].xyz;
    if (by.over != 0) return before;
    const vec3 direction = vectors[passed_vector((run.step + 1) & 1, i, kConditioned, h)].xyz +
                           beta * vectors[own_vector(i, kDirection, h)].xyz;
    return before + by.alpha * direction;
}

// The rotation by |r| radians about r. Small angles, and steps end small, by series: Vulkan lets
// sin and cos be off by 2^-11.
vec4 rotation_from_vector(vec3 r) {
    const float angle = sqrt(dot(r, r)), x = 0.25 * angle * angle;  // half the angle, squared
    if (angle < 1.0)
        return normalize(
            vec4(0.5 * (1.0 - x / 6.0 * (1.0 - x / 20.0 * (1.0 - x / 42.0))) * r,
                 1.0 - x / 2.0 * (1.0 - x / 12.0 * (1.0 - x / 30.0 * (1.0 - x / 56.0)))));
    return normalize(vec4(sin(0.5 * angle) / angle * r, cos(0.5 * angle)));
}

// A pose, moved by that step.
struct Moved {
    vec4 rotation;
    vec3 position;
};
Moved move(uint i, vec3 turn, vec3 shift) {
    return Moved(normalize(multiply(rotation_from_vector(turn), present[kNodeVectors * i])),
                 present[kNodeVectors * i + 2].xyz + shift);
}
DualQuaternion motion_of(uint i, Moved pose) {
    return from_rigid(pose.rotation, pose.position - rotate(pose.rotation, rest[i].xyz));
}

LmMove take_step(LmGradients by, float beta, uint i) {
    const vec3 turn = solution(by, beta, i, 0), shift = solution(by, beta, i, 1);
    const float largest = max(push.spacing2 * dot(turn, turn), dot(shift, shift));
    const bool good = finite(turn) && finite(shift);
    Moved pose = Moved(present[kNodeVectors * i], present[kNodeVectors * i + 2].xyz);
    if (good) pose = move(i, turn, shift);
    const DualQuaternion motion = motion_of(i, pose);
    trial[kNodeVectors * i] = motion.real;
    trial[kNodeVectors * i + 1] = motion.dual;
    trial[kNodeVectors * i + 2] = vec4(pose.position, 0);
    return LmMove(good ? largest : 0.0, good ? 0 : 1);
}

// By the conjugate gradients: their sums, over all control points, tell whether the step is finite.
void end_run(LmState state, Left left, uint me, uint i) {
    LmState end = state;
    bool moves = trusts_step(state);
    float beta = 0.0;
    LmGradients by = LmGradients(0, 0, 0, 0);
    if (moves) {
        by = advance(left, me, beta);
        moves = finite(by.rho) && finite(by.alpha) && finite(beta);
        end = after_trusted(state, moves);
    }
    if (i < push.nodes) {
        DualQuaternion motion =
            DualQuaternion(present[kNodeVectors * i], present[kNodeVectors * i + 1]);
        if (has_failed(end))
            motion = usable_motion(motions[i]);
        else if (moves)
            motion = motion_of(i, move(i, solution(by, beta, i, 0), solution(by, beta, i, 1)));
        results[i] = store_motion(motion);
    }
    if (i == 0) summary = summary_of(end);
}

void main() {
    const uint me = gl_LocalInvocationIndex, i = gl_GlobalInvocationID.x;
    LmGradients by = LmGradients(0, 0, 0, 0);
    float beta = 0.0;
    Left left;
    if (run.step > 0) left = load_left(me);
    const LmState state = states[run.evaluation & 1];
    if ((run.given & kTrustsLastStep) != 0) {
        end_run(state, left, me, i);
        return;
    }
    if (stopped(state)) return;
    if (run.step > 0) by = advance(left, me, beta);
    LmMove own = LmMove(0, 0);
    if (i < push.nodes) own = take_step(by, beta, i);
    shares[me] = own;
    barrier();
    if (me < kEighths) {
        for (uint k = kEighths; k < kNodeGroup; k += kEighths) own = farther(own, shares[me + k]);
        shares[me] = own;
    }
    barrier();
    if (me != 0) return;
    for (uint k = 1; k < kEighths; ++k) own = farther(own, shares[k]);
    moves[gl_WorkGroupID.x] = own;
}
