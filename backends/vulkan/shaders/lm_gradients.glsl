// What each step of the conjugate gradients begins with: the scalars, from the sums that the step
// before left. Every invocation finds them by itself. The recurrences with one round of sums for
// each step are those of Chronopoulos and Gear (1989). Needs lm.glsl, lm_blocks.glsl.
layout(std430, set = 0, binding = 0) readonly buffer States { LmState states[2]; };
layout(std430, set = 0, binding = 1) buffer Progress { LmGradients progress[2]; };
layout(std430, set = 0, binding = 2) buffer Products {
    vec2 products[];
};  // two copies; of each work group: r M^-1 r, r M^-1 A M^-1 r
layout(std430, set = 0, binding = 3) buffer Vectors { vec4 vectors[]; };
#include "lm_vectors.glsl"

uint product_groups() { return (push.nodes * kSplit + kBlockGroup - 1) / kBlockGroup; }

shared vec2 product_shares[kBlockGroup];

// What the step before left: an invocation's share of the products, and the scalars. Loaded before
// anything waits.
struct Left {
    vec2 share;
    LmGradients before;
};
Left load_left(uint me) {
    const uint groups = product_groups(), from = ((run.step - 1) & 1) * groups;
    vec2 sum = vec2(0);
    for (uint i = me; i < groups; i += kBlockGroup) sum += products[from + i];
    return Left(sum, progress[(run.step - 1) & 1]);
}

// The scalars of a step, from 1. To be called by the whole work group.
LmGradients advance(Left left, uint me, out float beta) {
    product_shares[me] = left.share;
    barrier();
    if (me < kEighths) {
        vec2 sum = left.share;
        for (uint i = kEighths; i < kBlockGroup; i += kEighths) sum += product_shares[me + i];
        product_shares[me] = sum;
    }
    barrier();
    vec2 sum = vec2(0);
    for (uint i = 0; i < kEighths; ++i) sum += product_shares[i];
    const bool first = run.step == 1;
    if (!first && left.before.over != 0) {  // whose last steps left no sums
        beta = 0.0;
        return LmGradients(left.before.rho, 0.0, left.before.enough, 1);
    }
    const float rho = sum.x;
    beta = first ? 0.0 : rho / left.before.rho;
    const float curvature = first ? sum.y : sum.y - beta * rho / left.before.alpha;  // p A p
    const float enough =
        first ? kConjugateTolerance * kConjugateTolerance * rho : left.before.enough;
    const bool over = !(rho > enough) || !(curvature > 0.0);
    return LmGradients(rho, over ? 0.0 : rho / curvature, enough, over ? 1 : 0);
}
