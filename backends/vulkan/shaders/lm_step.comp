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

const uint kHalves = kSplit == 1 ? 2 : 1;  // that an invocation keeps of a control point's vectors

shared vec3 shares[2][kBlockGroup];
shared vec2 sums[kBlockGroup];

// The scalars of this step.
struct Factors {
    float alpha, beta;
};

mat3 quarter(uint block, uint which) {
    const uint at = kBlockVectors * block + 3 * which;
    return mat3(matrix[at].xyz, matrix[at + 1].xyz, matrix[at + 2].xyz);
}
mat3 inverse_quarter(uint node, uint which) {
    const uint at = kBlockVectors * node + 3 * which;
    return mat3(inverses[at].xyz, inverses[at + 1].xyz, inverses[at + 2].xyz);
}

// Half of what the step before passed on of a control point.
struct Passed {
    vec3 conditioned, product, direction;
};
Passed load_passed(uint node, uint h) {
    const uint copy = (run.step + 1) & 1;
    Passed passed =
        Passed(vectors[passed_vector(copy, node, kConditioned, h)].xyz, vec3(0), vec3(0));
    if (run.step > 0) {
        passed.product = vectors[passed_vector(copy, node, kConditionedProduct, h)].xyz;
        passed.direction = vectors[passed_vector(copy, node, kConditionedDirection, h)].xyz;
    }
    return passed;
}
// M^-1 A p and M^-1 r of this step.
vec3 conditioned_direction(Factors by, Passed passed) {
    return passed.product + by.beta * passed.direction;
}
vec3 conditioned(Factors by, Passed passed) {
    return passed.conditioned - by.alpha * conditioned_direction(by, passed);
}

// A block of the row with the vectors that it meets.
struct Block {
    mat3 turn_turn, turn_shift, shift_turn, shift_shift;
    Passed turn, shift;
};
Block load_block(uint b) {
    const uint column = columns[b];
    return Block(quarter(b, 0), quarter(b, 1), quarter(b, 2), quarter(b, 3), load_passed(column, 0),
                 load_passed(column, 1));
}

// What is kept of half a control point.
struct Own {
    mat3 inverse_turn, inverse_shift;  // the half's rows of M^-1
    Passed passed;
    vec3 direction, direction_product, solution, residual, product;
};
Own load_own(uint i, uint h) {
    Own own = Own(inverse_quarter(i, 2 * h), inverse_quarter(i, 2 * h + 1), load_passed(i, h),
                  vec3(0), vec3(0), vec3(0), vectors[own_vector(i, kResidual, h)].xyz, vec3(0));
    if (run.step > 0) {
        own.direction = vectors[own_vector(i, kDirection, h)].xyz;
        own.direction_product = vectors[own_vector(i, kDirectionProduct, h)].xyz;
        own.solution = vectors[own_vector(i, kSolution, h)].xyz;
        own.product = vectors[own_vector(i, kProduct, h)].xyz;
    }
    return own;
}

// Brings half a control point's vectors to this step, and gives its part of the products. turn,
// shift: A M^-1 r, of which `product` is the half's.
vec2 update(Factors by, Own own, uint i, uint h, vec3 turn, vec3 shift, vec3 product) {
    const vec3 x = conditioned(by, own.passed);
    vec3 direction = vec3(0), direction_product = vec3(0);
    if (run.step > 0) {
        direction = own.passed.conditioned + by.beta * own.direction;
        direction_product = own.product + by.beta * own.direction_product;
    }
    const vec3 residual = own.residual - by.alpha * direction_product;
    vectors[own_vector(i, kDirection, h)] = vec4(direction, 0);
    vectors[own_vector(i, kDirectionProduct, h)] = vec4(direction_product, 0);
    vectors[own_vector(i, kSolution, h)] = vec4(own.solution + by.alpha * direction, 0);
    vectors[own_vector(i, kResidual, h)] = vec4(residual, 0);
    vectors[own_vector(i, kProduct, h)] = vec4(product, 0);
    const uint copy = run.step & 1;
    vectors[passed_vector(copy, i, kConditioned, h)] = vec4(x, 0);
    vectors[passed_vector(copy, i, kConditionedProduct, h)] =
        vec4(own.inverse_turn * turn + own.inverse_shift * shift, 0);
    vectors[passed_vector(copy, i, kConditionedDirection, h)] =
        vec4(conditioned_direction(by, own.passed), 0);
    return vec2(dot(residual, x), dot(product, x));
}

// Adds up what the invocations that share a control point have, to the first of them.
void add_shares(uint me, uint split) {
    for (uint apart = kSplit / 2; apart > 0; apart /= 2) {
        barrier();
        if (split < apart) {
            shares[0][me] += shares[0][me + apart];
            shares[1][me] += shares[1][me + apart];
        }
    }
    barrier();
}

void main() {
    const uint me = gl_LocalInvocationIndex, split = me % kSplit, first = me - split,
               i = gl_GlobalInvocationID.x / kSplit;
    // Everything is loaded before the scalars are waited for: a step is bound by latency.
    const bool keeps = split < 2 && i < push.nodes;
    uint next = 0, end = 0;
    if (i < push.nodes) {
        next = row_starts[i] + split;
        end = row_starts[i + 1];
    }
    Left left;
    if (run.step > 0) left = load_left(me);
    if (stopped(states[run.evaluation & 1])) return;
    Block block;
    if (next < end) block = load_block(next);
    Own own[kHalves];
    if (keeps)
        for (uint k = 0; k < kHalves; ++k) own[k] = load_own(i, split + k);
    Factors by = Factors(0, 0);
    if (run.step > 0) {
        float beta;
        const LmGradients advanced = advance(left, me, beta);
        if (gl_GlobalInvocationID.x == 0) progress[run.step & 1] = advanced;
        if (advanced.over != 0) return;
        by = Factors(advanced.alpha, beta);
    }
    vec3 turn = vec3(0), shift = vec3(0);  // of A M^-1 r
    while (next < end) {
        const vec3 x = conditioned(by, block.turn), y = conditioned(by, block.shift);
        turn += block.turn_turn * x + block.turn_shift * y;
        shift += block.shift_turn * x + block.shift_shift * y;
        next += kSplit;
        if (next < end) block = load_block(next);
    }
    shares[0][me] = turn;
    shares[1][me] = shift;
    add_shares(me, split);
    vec2 sum = vec2(0);
    if (keeps) {
        turn = shares[0][first];
        shift = shares[1][first];
        for (uint k = 0; k < kHalves; ++k) {
            const uint h = split + k;
            sum += update(by, own[k], i, h, turn, shift, h == 0 ? turn : shift);
        }
    }
    sums[me] = sum;
    barrier();
    if (me != 0) return;
    sum = vec2(0);
    for (uint k = 0; k < kBlockGroup; k += kSplit)
        for (uint h = 0; h < min(kSplit, 2); ++h) sum += sums[k + h];
    products[(run.step & 1) * product_groups() + gl_WorkGroupID.x] = sum;
}
