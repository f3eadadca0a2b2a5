// The rotation R that maximises trace(R^T m), never a reflection: the eigenvector of the largest
// eigenvalue of Horn's (1987) symmetric 4x4 matrix as a quaternion. Where R is not unique it is one
// of the best.

// The square of a symmetric matrix.
mat4 squared(mat4 m) {
    const float xy = dot(m[0], m[1]), xz = dot(m[0], m[2]), xw = dot(m[0], m[3]);
    const float yz = dot(m[1], m[2]), yw = dot(m[1], m[3]), zw = dot(m[2], m[3]);
    return mat4(dot(m[0], m[0]), xy, xz, xw,  //
                xy, dot(m[1], m[1]), yz, yw,  //
                xz, yz, dot(m[2], m[2]), zw,  //
                xw, yw, zw, dot(m[3], m[3]));
}

// A unit eigenvector of the largest eigenvalue of a symmetric matrix, none of whose eigenvalues is
// negative. Squaring it again and again leaves nothing but that eigenvector times itself; where the
// eigenvalue is a double one, some vector of its plane.
vec4 dominant_eigenvector(mat4 m) {
    const int kRounds = 5;           // of four squarings: eigenvalues apart by 1e-5 of their size
    const float kNearlyOne = 0.999;  // of trace(m^2) where trace(m) is 1: alone after one more
    for (int round = 0; round < kRounds; ++round) {
        m *= 1.0 / (m[0].x + m[1].y + m[2].z + m[3].w);
        m = squared(m);
        const bool alone = m[0].x + m[1].y + m[2].z + m[3].w > kNearlyOne;
        m = squared(m);
        if (alone) break;
        m = squared(m);
        m = squared(m);
    }
    vec4 column = m[0];
    float largest = m[0].x;
    if (m[1].y > largest) {
        largest = m[1].y;
        column = m[1];
    }
    if (m[2].z > largest) {
        largest = m[2].z;
        column = m[2];
    }
    if (m[3].w > largest) column = m[3];
    return column * inversesqrt(dot(column, column));
}

// m[row][column] as sum of to * from^T; rows of the result likewise. The identity for a matrix that
// is zero or not finite.
mat3 nearest_rotation(mat3 m) {
    const float squares = dot(m[0], m[0]) + dot(m[1], m[1]) + dot(m[2], m[2]);
    if (!(squares > 1e-30 && squares < 1e38)) return mat3(1.0);
    const mat3 n = m * inversesqrt(squares);
    const float kShift = 1.7320508;  // no eigenvalue is below -sqrt(3) |m|
    const float xx = n[0].x, yy = n[1].y, zz = n[2].z;
    const float wx = n[2].y - n[1].z, wy = n[0].z - n[2].x, wz = n[1].x - n[0].y;
    const float xy = n[0].y + n[1].x, xz = n[0].z + n[2].x, yz = n[1].z + n[2].y;
    const vec4 q = dominant_eigenvector(mat4(kShift + xx - yy - zz, xy, xz, wx,  //
                                             xy, kShift + yy - xx - zz, yz, wy,  //
                                             xz, yz, kShift + zz - xx - yy, wz,  //
                                             wx, wy, wz, kShift + xx + yy + zz));
    const float x = q.x, y = q.y, z = q.z, w = q.w;
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
