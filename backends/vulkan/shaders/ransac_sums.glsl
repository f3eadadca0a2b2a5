// Sums of 3x3 matrices over a work group of kSize invocations in a fixed tree. Vectors instead of
// loops over nine numbers: loops count (docs/vulkan.md).
layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint kSize = 64;  // a power of two, at most 512

shared vec3 partial[3][kSize];

// The sum of every invocation's matrix, to all of them.
mat3 sum_over_group(mat3 own, uint me) {
    partial[0][me] = own[0];
    partial[1][me] = own[1];
    partial[2][me] = own[2];
    barrier();
    for (uint half_size = kSize / 2; half_size > 0; half_size >>= 1) {
        if (me < half_size) {
            partial[0][me] += partial[0][me + half_size];
            partial[1][me] += partial[1][me + half_size];
            partial[2][me] += partial[2][me + half_size];
        }
        barrier();
    }
    const mat3 total = mat3(partial[0][0], partial[1][0], partial[2][0]);
    barrier();
    return total;
}

// weight b a^T, row by row.
mat3 moment(float weight, vec3 b, vec3 a) {
    return mat3(weight * b.x * a, weight * b.y * a, weight * b.z * a);
}
