// Stage lm, section 4: the rigid motion that brings the deformed landmarks onto their preselected
// matches, and every control point's start by it. One work group.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "lm.glsl"
#include "ransac_sums.glsl"
#include "nearest_rotation.glsl"

layout(std430, set = 0, binding = 0) readonly buffer Motions { Motion motions[]; };
layout(std430, set = 0, binding = 1) readonly buffer Items { vec4 items[]; };
layout(std430, set = 0, binding = 2) readonly buffer ItemNodes { ivec4 item_nodes[]; };
layout(std430, set = 0, binding = 3) readonly buffer Matches { Match matches[]; };
layout(std430, set = 0, binding = 4) buffer Deformed {
    vec4 deformed[];
};  // landmarks; w: their matches' weight, 0 where not preselected
layout(std430, set = 0, binding = 5) readonly buffer Rest { vec4 rest[]; };
layout(std430, set = 0, binding = 6) writeonly buffer Trial { vec4 trial[]; };
#include "lm_start.glsl"

shared mat3 rotation;  // rows
shared vec3 shift;
shared vec4 turn;  // of the start, as shift is then

// Turns two columns so that they are orthogonal; false where they are so already.
bool make_orthogonal(inout vec3 a, inout vec3 b) {
    const float aa = dot(a, a), bb = dot(b, b), across = dot(a, b);
    if (!(across * across > 1e-13 * aa * bb)) return false;
    const float theta = (bb - aa) / (2.0 * across);
    const float t = (theta < 0.0 ? -1.0 : 1.0) / (abs(theta) + sqrt(theta * theta + 1.0));
    const float c = inversesqrt(t * t + 1.0), s = t * c;
    const vec3 turned_a = c * a - s * b;
    b = s * a + c * b;
    a = turned_a;
    return true;
}

// The second singular value of a matrix, by one-sided Jacobi rotations of its columns.
float second_singular_value(mat3 m) {
    vec3 x = m[0], y = m[1], z = m[2];
    for (int sweep = 0; sweep < 6; ++sweep) {
        const bool xy = make_orthogonal(x, y), xz = make_orthogonal(x, z),
                   yz = make_orthogonal(y, z);
        if (!xy && !xz && !yz) break;
    }
    const float a = length(x), b = length(y), c = length(z);
    return max(min(a, b), min(max(a, b), c));
}

// r: rows. The largest component is computed first (Shepperd 1978).
vec4 quaternion_of(mat3 r) {
    const float xx = r[0].x, yy = r[1].y, zz = r[2].z;
    const vec4 four =
        vec4(1.0 + xx - yy - zz, 1.0 - xx + yy - zz, 1.0 - xx - yy + zz, 1.0 + xx + yy + zz);
    const vec3 skew = vec3(r[2].y - r[1].z, r[0].z - r[2].x, r[1].x - r[0].y);
    const float xy = r[0].y + r[1].x, xz = r[0].z + r[2].x, yz = r[1].z + r[2].y;
    const float largest = max(max(four.x, four.y), max(four.z, four.w));
    vec4 q;
    if (four.w == largest)
        q = vec4(skew, four.w);
    else if (four.x == largest)
        q = vec4(four.x, xy, xz, skew.x);
    else if (four.y == largest)
        q = vec4(xy, four.y, yz, skew.y);
    else
        q = vec4(xz, yz, four.z, skew.z);
    return normalize(q);
}

float squared_error(uint i) {
    const vec3 error = turned(rotation, deformed[i].xyz) + shift - load3(matches[i].position);
    return dot(error, error);
}

// Tukey's cost under the present rotation and shift, and under none.
vec2 costs(uint me) {
    const float inverse_c2 = 1.0 / (push.match_tukey * push.match_tukey);
    mat3 sum = mat3(0.0);
    for (uint i = me; i < push.landmarks; i += kSize) {
        const float weight = deformed[i].w;
        if (weight == 0.0) continue;
        const vec3 error = deformed[i].xyz - load3(matches[i].position);
        sum[0].x += weight * tukey(squared_error(i), inverse_c2).cost;
        sum[0].y += weight * tukey(dot(error, error), inverse_c2).cost;
    }
    return sum_over_group(sum, me)[0].xy;
}

// One round of weighted Procrustes.
void fit(uint me, float inverse_c2) {
    mat3 mean = mat3(0.0);
    for (uint i = me; i < push.landmarks; i += kSize) {
        if (deformed[i].w == 0.0) continue;
        const float weight = deformed[i].w * tukey(squared_error(i), inverse_c2).weight;
        mean += weight * mat3(deformed[i].xyz, load3(matches[i].position), vec3(1, 0, 0));
    }
    mean = sum_over_group(mean, me);
    const float total = mean[2].x;
    const bool any = total > 0.0;
    const vec3 from = any ? mean[0] / total : vec3(0);
    const vec3 to = any ? mean[1] / total : vec3(0);
    mat3 moments = mat3(0.0);
    for (uint i = me; any && i < push.landmarks; i += kSize) {
        if (deformed[i].w == 0.0) continue;
        const float weight = deformed[i].w * tukey(squared_error(i), inverse_c2).weight;
        moments += moment(weight, load3(matches[i].position) - to, deformed[i].xyz - from);
    }
    moments = sum_over_group(moments, me);
    if (me == 0) {
        const mat3 m = any ? moments * (1.0 / total) : mat3(0.0);
        rotation = second_singular_value(m) > kMinSpreadMm2 ? nearest_rotation(m) : mat3(1.0);
        shift = to - turned(rotation, from);
    }
    barrier();
}

void main() {
    const uint me = gl_LocalInvocationIndex;
    if (me == 0) {
        rotation = mat3(1.0);
        shift = vec3(0);
    }
    mat3 count = mat3(0.0);
    for (uint i = me; i < push.landmarks; i += kSize) {
        const uint item = push.points + i;
        const bool taken = preselected(matches[i]);
        DualQuaternion moved_by[4];
        float weight[4];
        for (int k = 0; k < 4; ++k) {
            moved_by[k] = usable_motion(motions[item_nodes[item][k]]);
            weight[k] = items[kItemVectors * item + 2 + k].w;
        }
        deformed[i] = vec4(apply(blend(moved_by, weight), items[kItemVectors * item].xyz),
                           taken ? matches[i].weight : 0.0);
        count[0].x += taken ? 1.0 : 0.0;
    }
    const bool enough = sum_over_group(count, me)[0].x >= float(kPresolveMinMatches);
    float before = 0.0;
    for (int round = 0; enough && round < kPresolveRounds; ++round) {
        mat3 spread = mat3(0.0);
        for (uint i = me; i < push.landmarks; i += kSize) {
            if (deformed[i].w == 0.0) continue;
            spread[0].x += deformed[i].w;
            spread[0].y += deformed[i].w * squared_error(i);
        }
        spread = sum_over_group(spread, me);
        if (round > 0 && abs(spread[0].y - before) <= kPresolveMinChange * before) break;
        before = spread[0].y;
        fit(me, 1.0 / max(push.match_tukey * push.match_tukey,
                          kPresolveMinWidth2 * spread[0].y / spread[0].x));
    }
    const vec2 cost = costs(me);
    if (me == 0) {
        const bool closer = enough && cost.x < cost.y;
        turn = closer ? quaternion_of(rotation) : vec4(0, 0, 0, 1);
        if (!closer) shift = vec3(0);
    }
    barrier();
    for (uint i = me; i < push.nodes; i += kSize) start(i, turn, shift);
}
