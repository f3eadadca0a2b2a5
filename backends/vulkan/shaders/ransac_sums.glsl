// Sums of 3x3 matrices over a work group of kSize invocations in a fixed tree.
#extension GL_EXT_control_flow_attributes : require
layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint kSize = 64;  // a power of two, 64 to 512

// Sixteen are added at a time, so that there are few barriers.
const uint kParts = kSize / 16;
shared float all_parts[9][kSize], parts[9][kParts];
shared vec4 last_parts[9];

// The sum of every invocation's matrix, to all of them.
mat3 sum_over_group(mat3 own, uint me) {
    [[unroll]] for (uint k = 0; k < 9; ++k) all_parts[k][me] = own[k / 3][k % 3];
    barrier();
    if (me < 9 * kParts) {
        const uint k = me / kParts, part = me % kParts;
        vec4 sum = vec4(0);
        [[unroll]] for (uint i = 0; i < 16; i += 4) [[unroll]] for (uint j = 0; j < 4; ++j)
            sum[j] += all_parts[k][part + (i + j) * kParts];
        parts[k][part] = (sum.x + sum.y) + (sum.z + sum.w);
    }
    barrier();
    if (me < 9 * 4) {
        float sum = parts[me / 4][me % 4];
        [[unroll]] for (uint i = 4; i < kParts; i += 4) sum += parts[me / 4][me % 4 + i];
        last_parts[me / 4][me % 4] = sum;
    }
    barrier();
    mat3 total;
    [[unroll]] for (uint k = 0; k < 9; ++k) {
        const vec4 four = last_parts[k];
        total[k / 3][k % 3] = (four.x + four.y) + (four.z + four.w);
    }
    return total;
}

// weight b a^T, row by row.
mat3 moment(float weight, vec3 b, vec3 a) {
    return mat3(weight * b.x * a, weight * b.y * a, weight * b.z * a);
}
