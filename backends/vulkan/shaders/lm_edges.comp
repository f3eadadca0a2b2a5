// Stage lm: the ARAP term of each edge by the trial motions (backends/shared/lm_arap.hpp), one
// invocation each. Evaluation 0 knows no S: lm_data.comp adds its costs up.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "lm.glsl"
layout(local_size_x = kResidualGroup) in;

struct RestEdge {
    vec4 rest;  // direction from a to b, and length
    uint a, b;
    float share;  // of the data's weight that S is
    uint unused;
};
layout(std430, set = 0, binding = 0) readonly buffer Edges { RestEdge edges[]; };
layout(std430, set = 0, binding = 1) readonly buffer Trial { vec4 trial[]; };
layout(std430, set = 0, binding = 2) readonly buffer Data { float data[]; };
layout(std430, set = 0, binding = 3) writeonly buffer EdgeCosts { float edge_costs[]; };
layout(std430, set = 0, binding = 4) writeonly buffer EdgeRecords { vec4 edge_records[]; };
layout(std430, set = 0, binding = 5) writeonly buffer Terms { LmTerm terms[]; };
layout(std430, set = 0, binding = 6) readonly buffer States { LmState states[2]; };
#include "lm_group_sum.glsl"
#include "lm_weights.glsl"

// Keeps what the blocks need, and returns the cost if S were 1.
float evaluate(uint i, RestEdge edge) {
    const vec4 qa = trial[kNodeVectors * edge.a];
    vec4 qb = trial[kNodeVectors * edge.b];
    if (dot(qa, qb) < 0.0) qb = -qb;
    const vec3 along = trial[kNodeVectors * edge.b + 2].xyz - trial[kNodeVectors * edge.a + 2].xyz;
    const float size = sqrt(dot(along, along)), divisor = max(size, kMinLengthMm),
                stretch = size - edge.rest.w;
    const vec3 now = along / divisor, turned_a = rotate(qa, edge.rest.xyz),
               turned_b = rotate(qb, -edge.rest.xyz);
    edge_records[kEdgeVectors * i] = vec4(now, divisor);
    edge_records[kEdgeVectors * i + 1] = vec4(turned_a, stretch);
    edge_records[kEdgeVectors * i + 2] = vec4(turned_b, edge.share);
    edge_records[kEdgeVectors * i + 3] = multiply(qa, conjugate(qb));
    const vec3 ab = turned_a - now, ba = turned_b + now;
    const vec4 turn = qa - qb;
    return 2.0 * (push.length_weight * stretch * stretch + push.rotation_weight * dot(turn, turn)) +
           push.angle_weight * (dot(ab, ab) + dot(ba, ba));
}

void main() {
    float usual = 0.0;
    if (run.evaluation > 0) {
        const LmState before = states[(run.evaluation - 1) & 1];
        if (stopped(before)) return;
        usual = before.usual;
    }
    const uint me = gl_LocalInvocationIndex, i = gl_GlobalInvocationID.x;
    const bool exists = i < run.edges;
    RestEdge edge;
    float cost = 0.0;
    if (exists) {
        edge = edges[i];
        cost = evaluate(i, edge);
    }
    if (run.evaluation == 0) {
        if (exists) edge_costs[i] = edge.share * cost;
        return;
    }
    if (exists) cost *= edge_scale(edge.share, data[edge.a], data[edge.b], usual);
    const LmTerm sum = sum_over_group(LmTerm(cost, 0, 0, 0, 0), me);
    if (me == 0) terms[groups_before(kEdges) + gl_WorkGroupID.x] = sum;
}
