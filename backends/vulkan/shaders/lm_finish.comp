// Stage lm: classifies the last evaluation or trusts the last step, and gives out motions and
// summary.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "lm.glsl"
layout(local_size_x = kNodeGroup) in;
const uint kClassifies = kNodeGroup;
#include "lm_classify.glsl"

layout(std430, set = 0, binding = 4) readonly buffer Given { Motion motions[]; };
layout(std430, set = 0, binding = 5) readonly buffer Present { vec4 present[]; };
layout(std430, set = 0, binding = 6) readonly buffer Trial { vec4 trial[]; };
layout(std430, set = 0, binding = 7) writeonly buffer Results { Motion results[]; };
layout(std430, set = 0, binding = 8) writeonly buffer Summary { LmSummary summary; };

float rms(LmTerm term) { return term.weights > 0.0 ? sqrt(term.squares / term.weights) : 0.0; }

void main() {
    const uint me = gl_LocalInvocationIndex, i = gl_GlobalInvocationID.x;
    if ((run.given & kTrustsLastStep) != 0) {
        trust(me);
    } else if (stopped_before()) {
        if (me == 0) {
            now = states[(run.evaluation - 1) & 1];
            accepted = false;
        }
        barrier();
    } else {
        share_sums(me);
        classify(me);
    }
    const bool failed = now.failed != 0 || (now.iterations > 0 && now.any_step == 0);
    if (i < push.nodes) {
        DualQuaternion motion = usable_motion(motions[i]);
        if (!failed)
            motion = accepted
                         ? DualQuaternion(trial[kNodeVectors * i], trial[kNodeVectors * i + 1])
                         : DualQuaternion(present[kNodeVectors * i], present[kNodeVectors * i + 1]);
        results[i] = store_motion(motion);
    }
    if (i != 0) return;
    const float missing =
        float(now.icp.missing) * (push.icp_weight * push.icp_tukey * push.icp_tukey / 3.0);
    const float cost = now.icp.cost + now.match.cost + now.patch_.cost + now.arap + missing;
    summary =
        LmSummary(now.initial_cost, cost, now.icp.cost, now.match.cost, now.patch_.cost, now.arap,
                  now.iterations, int(now.icp.count), int(now.match.count), int(now.patch_.count),
                  rms(now.icp), rms(now.match), rms(now.patch_), now.lambda, failed ? 1 : 0, 0);
}
