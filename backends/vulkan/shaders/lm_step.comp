// Stage lm: one step of the conjugate gradients, preconditioned by the damped diagonal blocks; step
// 0 prepares. kSplit invocations share a control point.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "lm.glsl"
#include "lm_blocks.glsl"
#include "lm_gradients.glsl"

layout(std430, set = 0, binding = 4) readonly buffer Matrix { vec4 matrix[]; };
layout(std430, set = 0, binding = 5) readonly buffer RowStarts { uint row_starts[]; };
layout(std430, set = 0, binding = 6) readonly buffer Columns { uint columns[]; };
layout(std430, set = 0, binding = 7) readonly buffer Inverses { vec4 inverses[]; };

shared vec3 shares[2][kBlockGroup];
shared vec2 sums[kBlockGroup];

// The scalars of this step.
struct Factors {
    float alpha, beta;
};

// M^-1 A p and M^-1 r of this step, half a control point's.
vec3 conditioned_direction(Factors by, uint node, uint h) {
    const uint copy = (run.step + 1) & 1;
    return vectors[passed_vector(copy, node, kConditionedProduct, h)].xyz +
           by.beta * vectors[passed_vector(copy, node, kConditionedDirection, h)].xyz;
}
vec3 conditioned(Factors by, uint node, uint h) {
    const vec3 before = vectors[passed_vector((run.step + 1) & 1, node, kConditioned, h)].xyz;
    return run.step == 0 ? before : before - by.alpha * conditioned_direction(by, node, h);
}

mat3 quarter(uint block, uint which) {
    const uint at = kBlockVectors * block + 3 * which;
    return mat3(matrix[at].xyz, matrix[at + 1].xyz, matrix[at + 2].xyz);
}
mat3 inverse_quarter(uint node, uint which) {
    const uint at = kBlockVectors * node + 3 * which;
    return mat3(inverses[at].xyz, inverses[at + 1].xyz, inverses[at + 2].xyz);
}

// One half of a control point's own vectors, to this step; returns r.
vec3 update(Factors by, uint i, uint h) {
    vec3 direction = vec3(0), direction_product = vec3(0), solution = vec3(0),
         residual = vectors[own_vector(i, kResidual, h)].xyz;
    if (run.step > 0) {
        const uint copy = (run.step + 1) & 1;
        direction = vectors[passed_vector(copy, i, kConditioned, h)].xyz +
                    by.beta * vectors[own_vector(i, kDirection, h)].xyz;
        direction_product = vectors[own_vector(i, kProduct, h)].xyz +
                            by.beta * vectors[own_vector(i, kDirectionProduct, h)].xyz;
        solution = vectors[own_vector(i, kSolution, h)].xyz + by.alpha * direction;
        residual -= by.alpha * direction_product;
    }
    vectors[own_vector(i, kDirection, h)] = vec4(direction, 0);
    vectors[own_vector(i, kDirectionProduct, h)] = vec4(direction_product, 0);
    vectors[own_vector(i, kSolution, h)] = vec4(solution, 0);
    vectors[own_vector(i, kResidual, h)] = vec4(residual, 0);
    return residual;
}

void main() {
    if (stopped(states[run.evaluation & 1])) return;
    const uint me = gl_LocalInvocationIndex, split = me % kSplit, first = me - split,
               i = gl_GlobalInvocationID.x / kSplit;
    Factors by = Factors(0, 0);
    if (run.step > 0) {
        advance(me);
        if (advanced.over != 0) return;
        by = Factors(advanced.alpha, beta);
    }
    uint next = 0, end = 0;
    if (i < push.nodes) {
        next = row_starts[i] + split;
        end = row_starts[i + 1];
    }
    vec3 turn = vec3(0), shift = vec3(0);  // of A M^-1 r
    for (uint b = next; b < end; b += kSplit) {
        const uint column = columns[b];
        const vec3 x = conditioned(by, column, 0), y = conditioned(by, column, 1);
        turn += quarter(b, 0) * x + quarter(b, 1) * y;
        shift += quarter(b, 2) * x + quarter(b, 3) * y;
    }
    shares[0][me] = turn;
    shares[1][me] = shift;
    barrier();
    for (uint h = split; h < 2 && i < push.nodes; h += kSplit) {
        vec3 sum = shares[h][first];
        for (uint s = 1; s < kSplit; ++s) sum += shares[h][first + s];
        shares[h][first] = sum;
    }
    barrier();
    vec2 own = vec2(0);
    for (uint h = split; h < 2 && i < push.nodes; h += kSplit) {
        const uint copy = run.step & 1;
        const vec3 product = shares[h][first], x = conditioned(by, i, h);
        const vec3 conditioned_product = inverse_quarter(i, 2 * h) * shares[0][first] +
                                         inverse_quarter(i, 2 * h + 1) * shares[1][first];
        const vec3 next_direction = run.step == 0 ? vec3(0) : conditioned_direction(by, i, h);
        const vec3 residual = update(by, i, h);
        vectors[own_vector(i, kProduct, h)] = vec4(product, 0);
        vectors[passed_vector(copy, i, kConditioned, h)] = vec4(x, 0);
        vectors[passed_vector(copy, i, kConditionedProduct, h)] = vec4(conditioned_product, 0);
        vectors[passed_vector(copy, i, kConditionedDirection, h)] = vec4(next_direction, 0);
        own += vec2(dot(residual, x), dot(product, x));
    }
    sums[me] = own;
    barrier();
    if (me != 0) return;
    vec2 sum = vec2(0);
    for (uint k = 0; k < kBlockGroup; ++k) sum += sums[k];
    products[(run.step & 1) * product_groups() + gl_WorkGroupID.x] = sum;
}
