// Stage lm: classifies the last evaluation or trusts the last step, and gives out motions and
// summary.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "lm.glsl"
layout(local_size_x = kNodeGroup) in;
const uint kClassifies = kNodeGroup;
#include "lm_classify.glsl"

layout(std430, set = 0, binding = 3) readonly buffer Given { Motion motions[]; };
layout(std430, set = 0, binding = 4) readonly buffer Present { vec4 present[]; };
layout(std430, set = 0, binding = 5) readonly buffer Trial { vec4 trial[]; };
layout(std430, set = 0, binding = 6) writeonly buffer Results { Motion results[]; };
layout(std430, set = 0, binding = 7) writeonly buffer Summary { LmSummary summary; };

#include "lm_result.glsl"

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
        classify(me, 0.0);
    }
    if (i < push.nodes) {
        DualQuaternion motion = usable_motion(motions[i]);
        if (!has_failed(now))
            motion = accepted
                         ? DualQuaternion(trial[kNodeVectors * i], trial[kNodeVectors * i + 1])
                         : DualQuaternion(present[kNodeVectors * i], present[kNodeVectors * i + 1]);
        results[i] = store_motion(motion);
    }
    if (i == 0) summary = summary_of(now);
}
