// What each step of the conjugate gradients begins with: the scalars, from the sums that the step
// before left. Every work group finds them by itself. The recurrences with one round of sums for
// each step are those of Chronopoulos and Gear (1989). Needs lm.glsl, lm_blocks.glsl.
layout(std430, set = 0, binding = 0) readonly buffer States { LmState states[2]; };
layout(std430, set = 0, binding = 1) buffer Progress { LmGradients progress[2]; };
layout(std430, set = 0, binding = 2) buffer Products {
    vec2 products[];
};  // two copies; of each work group: r M^-1 r, r M^-1 A M^-1 r
layout(std430, set = 0, binding = 3) buffer Vectors { vec4 vectors[]; };
#include "lm_vectors.glsl"

const float kTolerance = 1e-3;  // of the preconditioned residual's norm

uint product_groups() { return (push.nodes * kSplit + kBlockGroup - 1) / kBlockGroup; }

shared vec2 product_shares[kBlockGroup];
shared LmGradients advanced;
shared float beta;

// Sets advanced and beta. To be called by the whole work group, in steps from 1.
void advance(uint me) {
    const uint groups = product_groups(), from = ((run.step - 1) & 1) * groups;
    vec2 sum = vec2(0);
    for (uint i = me; i < groups; i += kBlockGroup) sum += products[from + i];
    product_shares[me] = sum;
    barrier();
    if (me == 0) {
        for (uint i = 1; i < min(groups, kBlockGroup); ++i) sum += product_shares[i];
        const bool first = run.step == 1;
        const LmGradients before = progress[(run.step - 1) & 1];
        const float rho = sum.x;
        const float ratio = first ? 0.0 : rho / before.rho;
        const float curvature = first ? sum.y : sum.y - ratio * rho / before.alpha;  // p A p
        const float enough = first ? kTolerance * kTolerance * rho : before.enough;
        const bool over = (!first && before.over != 0) || !(rho > enough) || !(curvature > 0.0);
        beta = ratio;
        advanced = LmGradients(rho, over ? 0.0 : rho / curvature, enough, over ? 1 : 0);
        if (gl_WorkGroupID.x == 0) progress[run.step & 1] = advanced;
    }
    barrier();
}
