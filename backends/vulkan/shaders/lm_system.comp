// Stage lm: classifies the last evaluation, and if that is the present state linearises there: the
// control points' own blocks, which are then damped and inverted, or those above the diagonal.
// kSplit invocations share a block, each with every kSplit-th of its terms.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require
#include "lm.glsl"
#include "lm_blocks.glsl"
layout(constant_id = 1) const bool kDiagonal = true;
const uint kClassifies = kBlockGroup;
#include "lm_classify.glsl"
#include "lm_inverse.glsl"

layout(std430, set = 0, binding = 3) readonly buffer Blocks { LmBlock blocks[]; };
layout(std430, set = 0, binding = 4) readonly buffer ItemTerms { uint item_terms[]; };
layout(std430, set = 0, binding = 5) readonly buffer EdgeTerms { LmEdgeTerm edge_terms[]; };
layout(std430, set = 0, binding = 6) readonly buffer Items { vec4 items[]; };
layout(std430, set = 0, binding = 7) readonly buffer Records { vec4 records[]; };
layout(std430, set = 0, binding = 8) readonly buffer EdgeRecords { vec4 edge_records[]; };
layout(std430, set = 0, binding = 9) readonly buffer Trial { vec4 trial[]; };
layout(std430, set = 0, binding = 10) writeonly buffer Present { vec4 present[]; };
layout(std430, set = 0, binding = 11) writeonly buffer Matrix { vec4 matrix[]; };  // damped
layout(std430, set = 0, binding = 12) buffer Diagonal {
    vec4 diagonal[];
};  // not damped; block, then half the gradient
layout(std430, set = 0, binding = 13) writeonly buffer Inverses {
    vec4 inverses[];
};  // of the damped diagonal
layout(std430, set = 0, binding = 14) writeonly buffer Vectors { vec4 vectors[]; };
layout(std430, set = 0, binding = 15) readonly buffer Data { float data[]; };
#include "lm_weights.glsl"
#include "lm_vectors.glsl"

const uint kColumns = kBlockVectors + 2;  // of a block, and its control point's gradient

// A block's quarters, the first and the third transposed, and half the gradient.
struct Sums {
    mat3 turn_turn, turn_shift, shift_turn, shift_shift;
    vec3 turn, shift;
};

shared vec3 shares[kColumns][kBlockGroup];
shared vec4 data_shares[kBlockGroup];

// G of an item.
mat3 squares_of(uint item) {
    const vec3 a = records[kRecordVectors * item].xyz, b = records[kRecordVectors * item + 1].xyz;
    return mat3(a, vec3(a.y, b.xy), vec3(a.z, b.yz));
}
// [v]x m
mat3 cross_columns(vec3 v, mat3 m) { return mat3(cross(v, m[0]), cross(v, m[1]), cross(v, m[2])); }

void add_items(LmBlock block, uint split, inout Sums sums) {
    const vec4 row_rotation = trial[kNodeVectors * block.row],
               column_rotation = trial[kNodeVectors * block.column];
    uint following = 0;  // loaded while the one before it is worked on
    if (block.first_item + split < block.last_item)
        following = item_terms[block.first_item + split];
    for (uint at = block.first_item + split; at < block.last_item; at += kSplit) {
        const uint term = following, item = term_item(term);
        if (at + kSplit < block.last_item) following = item_terms[at + kSplit];
        const bool same = kDiagonal && term_row(term) == term_column(term);
        const vec4 row = items[kItemVectors * item + 2 + term_row(term)];
        const vec3 a = rotate(row_rotation, row.xyz);
        float weight = row.w;
        vec3 b = a;
        if (same) {
            const vec3 pull = records[kRecordVectors * item + 2].xyz;
            sums.shift += row.w * pull;
            sums.turn += row.w * cross(a, pull);
        } else {
            const vec4 column = items[kItemVectors * item + 2 + term_column(term)];
            b = rotate(column_rotation, column.xyz);
            weight = column.w;
        }
        const mat3 g = squares_of(item) * (row.w * weight);
        const mat3 turned = cross_columns(a, g);
        sums.shift_shift += g;
        sums.turn_shift += turned;
        sums.shift_turn += cross_columns(b, g);
        sums.turn_turn += cross_columns(b, transpose(turned));
    }
}

mat3 cross_matrix(vec3 v) { return mat3(0, v.z, -v.y, -v.z, 0, v.x, v.y, -v.x, 0); }

void add_edges(LmBlock block, uint split, float usual, inout Sums sums) {
    for (uint at = block.first_edge + split; at < block.last_edge; at += kSplit) {
        const LmEdgeTerm term = edge_terms[at];
        const uint i = kEdgeVectors * term_edge(term);
        const vec3 now = edge_records[i].xyz, turned_a = edge_records[i + 1].xyz,
                   turned_b = edge_records[i + 2].xyz;
        const float size = edge_records[i].w, stretch = edge_records[i + 1].w;
        const float scale =
            edge_scale(edge_records[i + 2].w, data[block.row], data[term.other], usual);
        const vec4 relative = edge_records[i + 3];
        const float length_weight = scale * push.length_weight,
                    angle_weight = scale * push.angle_weight;
        const float rotation_weight = scale * push.rotation_weight, lever = angle_weight / size;
        const mat3 along = outerProduct(now, now), across = mat3(1.0) - along;
        const mat3 shift = (2.0 * lever / size) * across + (2.0 * length_weight) * along;
        if (!kDiagonal) {
            sums.shift_shift -= shift;
            sums.turn_turn -= 0.5 * rotation_weight *
                              (mat3(relative.w) - cross_matrix(relative.xyz));  // transposed
            sums.turn_shift -= lever * cross_columns(turned_a, across);
            sums.shift_turn -= lever * cross_columns(turned_b, across);
            continue;
        }
        const bool second = term_second(term);
        const vec3 turned = second ? turned_b : turned_a;
        const mat3 coupling = lever * cross_columns(turned, across);
        sums.shift_shift += shift;
        sums.turn_turn +=
            angle_weight * (mat3(1.0) - outerProduct(turned, turned)) + mat3(0.5 * rotation_weight);
        sums.turn_shift += coupling;
        sums.shift_turn += coupling;
        const vec3 lean = turned_b - turned_a;
        const vec3 pull =
            (2.0 * length_weight * stretch) * now + lever * (lean - dot(lean, now) * now);
        const vec3 turn = rotation_weight * relative.xyz;
        sums.shift += second ? pull : -pull;
        sums.turn += second ? angle_weight * cross(turned_b, now) - turn
                            : turn - angle_weight * cross(turned_a, now);
    }
}

void share(Sums sums, uint me) {
    const mat3 turn_turn = transpose(sums.turn_turn), shift_turn = transpose(sums.shift_turn);
    for (int c = 0; c < 3; ++c) {
        shares[c][me] = turn_turn[c];
        shares[3 + c][me] = sums.turn_shift[c];
        shares[6 + c][me] = shift_turn[c];
        shares[9 + c][me] = sums.shift_shift[c];
    }
    if (!kDiagonal) return;
    shares[12][me] = sums.turn;
    shares[13][me] = sums.shift;
}

// Column c of a block's transpose; its first share holds the block.
vec3 transposed_column(uint c, uint first) {
    const uint quarter = c / 3, from = 3 * (quarter == 1 ? 2 : quarter == 2 ? 1 : quarter);
    return vec3(shares[from][first][c % 3], shares[from + 1][first][c % 3],
                shares[from + 2][first][c % 3]);
}

// Marquardt's damping of control point i's block, and its inverse. What has no weight at all gets
// one, and stays where it is.
void damp(uint i, uint place, uint first) {
    float m[6][6];
    [[unroll]] for (int c = 0; c < 6; ++c) [[unroll]] for (int r = 0; r < 6; ++r) m[r][c] =
        shares[6 * (r / 3) + c][first][r % 3];
    float trace = 0.0;
    [[unroll]] for (int r = 0; r < 6; ++r) trace += m[r][r];
    const float minimum = trace > 0.0 ? kMinDiagonal * trace : 1.0;
    [[unroll]] for (int r = 0; r < 6; ++r) m[r][r] = m[r][r] * (1.0 + now.lambda) + minimum;
    float inverse[6][6];
    invert(m, inverse);
    [[unroll]] for (int half_row = 0; half_row < 2; ++half_row)
        [[unroll]] for (int c = 0; c < 6; ++c) {
        const uint at = 6 * half_row + c;  // as quarters by columns: see lm.glsl
        const int r = 3 * half_row;
        matrix[kBlockVectors * place + at] = vec4(m[r][c], m[r + 1][c], m[r + 2][c], 0);
        inverses[kBlockVectors * i + at] =
            vec4(inverse[r][c], inverse[r + 1][c], inverse[r + 2][c], 0);
    }
    const vec3 turn = -shares[12][first], shift = -shares[13][first];
    vec3 x[2] = vec3[2](vec3(0), vec3(0));
    [[unroll]] for (int h = 0; h < 2; ++h) [[unroll]] for (int r = 0; r < 3; ++r)
        [[unroll]] for (int c = 0; c < 3; ++c) x[h][r] +=
        inverse[3 * h + r][c] * turn[c] + inverse[3 * h + r][3 + c] * shift[c];
    [[unroll]] for (uint h = 0; h < 2; ++h) {
        vectors[own_vector(i, kResidual, h)] = vec4(h == 0 ? turn : shift, 0);
        vectors[passed_vector(1, i, kConditioned, h)] = vec4(x[h], 0);
    }
}

// Puts together what the invocations that share a block have of it, to the first of them.
void add_shares_of_block(uint split, uint first) {
    const uint columns = kDiagonal ? kColumns : kBlockVectors;
    for (uint c = split; c < columns; c += kSplit) {
        vec3 sum = shares[c][first];
        for (uint s = 1; s < kSplit; ++s) sum += shares[c][first + s];
        shares[c][first] = sum;
    }
}

void share_data_sums(uint me) {
    vec4 sum = vec4(0);
    for (uint i = me; i < run.data_groups; i += kBlockGroup) sum += data_sums(i);
    data_shares[me] = sum;
    barrier();
    if (me < kEighths)
        for (uint k = kEighths; k < kBlockGroup; k += kEighths)
            data_shares[me] += data_shares[me + k];
}

// A block above the diagonal, and its transpose below.
void give_block(LmBlock block, uint split, uint first) {
    for (uint c = split; c < kBlockVectors; c += kSplit) {
        matrix[kBlockVectors * block.place + c] = vec4(shares[c][first], 0);
        matrix[kBlockVectors * block.transposed + c] = vec4(transposed_column(c, first), 0);
    }
}

void main() {
    const uint me = gl_LocalInvocationIndex, split = me % kSplit, first = me - split;
    const uint b = gl_GlobalInvocationID.x / kSplit + (kDiagonal ? 0 : push.nodes);
    const bool exists = b < (kDiagonal ? push.nodes : run.blocks);
    const bool keeps_state = kDiagonal && gl_GlobalInvocationID.x == 0;
    if (stopped_before()) {
        if (keeps_state) states[run.evaluation & 1] = states[(run.evaluation - 1) & 1];
        return;
    }
    share_sums(me);
    if (run.evaluation == 0) share_data_sums(me);
    // Before it is known whether they are wanted, which they mostly are.
    LmBlock block;
    Sums sums = Sums(mat3(0.0), mat3(0.0), mat3(0.0), mat3(0.0), vec3(0), vec3(0));
    if (exists) {
        block = blocks[b];
        add_items(block, split, sums);
    }
    float usual, first_arap = 0.0;
    if (run.evaluation == 0) {
        barrier();
        vec4 of_all = data_shares[0];
        for (uint k = 1; k < kEighths; ++k) of_all += data_shares[k];
        usual = usual_weight(of_all.xy);
        first_arap = of_all.z + usual * of_all.w;
    } else {
        usual = states[(run.evaluation - 1) & 1].usual;
    }
    if (exists) {
        add_edges(block, split, usual, sums);
        share(sums, me);
    }
    classify(me, first_arap);
    if (keeps_state) {
        now.usual = usual;
        states[run.evaluation & 1] = now;
    }
    if (kDiagonal && accepted && exists && split == 0)
        for (uint v = 0; v < kNodeVectors; ++v)
            present[kNodeVectors * b + v] = trial[kNodeVectors * b + v];
    if (stopped(now) || !(kDiagonal || accepted)) return;
    if (accepted) {
        add_shares_of_block(split, first);
        if (kDiagonal && exists)
            for (uint c = split; c < kColumns; c += kSplit)
                diagonal[kColumns * b + c] = vec4(shares[c][first], 0);
    } else if (exists) {
        for (uint c = split; c < kColumns; c += kSplit)
            shares[c][first] = diagonal[kColumns * b + c].xyz;
    }
    barrier();
    if (!exists) return;
    if (!kDiagonal)
        give_block(block, split, first);
    else if (split == 0)
        damp(b, block.place, first);
}
