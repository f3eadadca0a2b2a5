// The inverse of a symmetric positive 6x6 matrix by Cholesky. Pivots that vanish in single
// precision are raised. Without loops the matrices are kept in registers. Needs lm.glsl.
void invert(float m[6][6], out float inverse[6][6]) {
    float factor[6][6], own[6][6];  // m = factor factor^T; own = factor^-1
    [[unroll]] for (int c = 0; c < 6; ++c) [[unroll]] for (int r = c; r < 6; ++r) {
        float value = m[r][c];
        const float minimum = value * kMinPivot;
        [[unroll]] for (int k = 0; k < c; ++k) value -= factor[r][k] * factor[c][k];
        if (r == c) {
            factor[c][c] = sqrt(max(value, minimum));
            own[c][c] = 1.0 / factor[c][c];
        } else {
            factor[r][c] = value * own[c][c];
        }
    }
    [[unroll]] for (int c = 0; c < 6; ++c) [[unroll]] for (int r = c + 1; r < 6; ++r) {
        float value = 0.0;
        [[unroll]] for (int k = c; k < r; ++k) value -= factor[r][k] * own[k][c];
        own[r][c] = value * own[r][r];
    }
    [[unroll]] for (int c = 0; c < 6; ++c) [[unroll]] for (int r = 0; r <= c; ++r) {
        float value = own[c][r] * own[c][c];
        [[unroll]] for (int k = c + 1; k < 6; ++k) value += own[k][r] * own[k][c];
        inverse[c][r] = inverse[r][c] = value;
    }
}
