// The rotation R that maximises trace(R^T m), never a reflection: the eigenvector of the largest
// eigenvalue of Horn's (1987) symmetric 4x4 matrix as a quaternion, by Jacobi's method. Where R is
// not unique it is one of the best.

// One Jacobi rotation that zeroes a[p][q]; v gathers the rotations. All indices are constants, so
// that nothing leaves the registers.
#define JACOBI_TURN(a, v, p, q, r, s)                                                          \
    if (abs(a[p][q]) > 1e-12 * (abs(a[p][p]) + abs(a[q][q]))) {                                \
        const float theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);                             \
        const float t = (theta < 0.0 ? -1.0 : 1.0) / (abs(theta) + sqrt(theta * theta + 1.0)); \
        const float c = 1.0 / sqrt(t * t + 1.0), d = t * c;                                    \
        const float apq = a[p][q], apr = a[p][r], aps = a[p][s], aqr = a[q][r], aqs = a[q][s]; \
        a[p][p] -= t * apq;                                                                    \
        a[q][q] += t * apq;                                                                    \
        a[p][q] = a[q][p] = 0.0;                                                               \
        a[p][r] = a[r][p] = c * apr - d * aqr;                                                 \
        a[q][r] = a[r][q] = d * apr + c * aqr;                                                 \
        a[p][s] = a[s][p] = c * aps - d * aqs;                                                 \
        a[q][s] = a[s][q] = d * aps + c * aqs;                                                 \
        const vec4 vp = v[p], vq = v[q];                                                       \
        v[p] = c * vp - d * vq;                                                                \
        v[q] = d * vp + c * vq;                                                                \
    }

// m[row][column] as sum of to * from^T; rows of the result likewise. The identity for a matrix that
// is zero or not finite.
mat3 nearest_rotation(mat3 m) {
    float largest = 0.0;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) largest = max(largest, abs(m[i][j]));
    const mat3 identity = mat3(1.0);
    if (!(largest > 0.0) || isinf(largest) || isnan(largest)) return identity;
    const mat3 n = m * (1.0 / largest);
    float a[4][4];
    a[0][0] = n[0][0] + n[1][1] + n[2][2];
    a[1][1] = n[0][0] - n[1][1] - n[2][2];
    a[2][2] = n[1][1] - n[0][0] - n[2][2];
    a[3][3] = n[2][2] - n[0][0] - n[1][1];
    a[0][1] = a[1][0] = n[2][1] - n[1][2];
    a[0][2] = a[2][0] = n[0][2] - n[2][0];
    a[0][3] = a[3][0] = n[1][0] - n[0][1];
    a[1][2] = a[2][1] = n[0][1] + n[1][0];
    a[1][3] = a[3][1] = n[0][2] + n[2][0];
    a[2][3] = a[3][2] = n[1][2] + n[2][1];
    vec4 v[4] = vec4[4](vec4(1, 0, 0, 0), vec4(0, 1, 0, 0), vec4(0, 0, 1, 0), vec4(0, 0, 0, 1));
    for (int sweep = 0; sweep < 6; ++sweep) {
        JACOBI_TURN(a, v, 0, 1, 2, 3)
        JACOBI_TURN(a, v, 0, 2, 1, 3)
        JACOBI_TURN(a, v, 0, 3, 1, 2)
        JACOBI_TURN(a, v, 1, 2, 0, 3)
        JACOBI_TURN(a, v, 1, 3, 0, 2)
        JACOBI_TURN(a, v, 2, 3, 0, 1)
    }
    vec4 q = v[0];
    float best = a[0][0];
    for (int i = 1; i < 4; ++i)
        if (a[i][i] > best) {
            best = a[i][i];
            q = v[i];
        }
    q *= 1.0 / sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    const float w = q.x, x = q.y, y = q.z, z = q.w;
    mat3 rotation;
    rotation[0] = vec3(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y));
    rotation[1] = vec3(2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x));
    rotation[2] = vec3(2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y));
    return rotation;
}

// Rows of r times v.
vec3 turned(mat3 r, vec3 v) {
    return vec3(r[0].x * v.x + r[0].y * v.y + r[0].z * v.z,
                r[1].x * v.x + r[1].y * v.y + r[1].z * v.z,
                r[2].x * v.x + r[2].y * v.y + r[2].z * v.z);
}
