// Sums over a work group of kSize invocations in a fixed tree, and the moments of pairs.
layout(local_size_x_id = 0) in;
layout(constant_id = 0) const uint kSize = 64;  // a power of two, at most 512

shared float partial[9][kSize];

// The sum of every invocation's nine numbers, to all of them.
void sum_over_group(inout float own[9], uint me) {
    for (int i = 0; i < 9; ++i) partial[i][me] = own[i];
    barrier();
    for (uint half_size = kSize / 2; half_size > 0; half_size >>= 1) {
        if (me < half_size)
            for (int i = 0; i < 9; ++i) partial[i][me] += partial[i][me + half_size];
        barrier();
    }
    for (int i = 0; i < 9; ++i) own[i] = partial[i][0];
    barrier();
}

void add_moment(inout float sum[9], float weight, vec3 b, vec3 a) {
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) sum[3 * i + j] += weight * b[i] * a[j];
}
mat3 as_matrix(float m[9]) { return mat3(m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8]); }
