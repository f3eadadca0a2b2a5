// Stage lm: the residuals of points, landmarks or patches by the trial motions, one invocation
// each.
#version 450
#extension GL_EXT_shader_16bit_storage : require
#extension GL_GOOGLE_include_directive : require
layout(constant_id = 0) const uint kKind = 0;  // kPoints ...
layout(std430, set = 0, binding = 0) readonly buffer Disparity { int16_t disparity[]; };
#define LIVE_DISPARITY(i) int(disparity[i])
#include "lm.glsl"
layout(local_size_x = kResidualGroup) in;

layout(std430, set = 0, binding = 1) readonly buffer Items { vec4 items[]; };
layout(std430, set = 0, binding = 2) readonly buffer ItemNodes { ivec4 item_nodes[]; };
layout(std430, set = 0, binding = 3) readonly buffer Trial { vec4 trial[]; };
layout(std430, set = 0, binding = 4) readonly buffer Matches { Match matches[]; };
layout(std430, set = 0, binding = 5) readonly buffer Observations {
    PatchObservation observations[];
};
layout(std430, set = 0, binding = 6) writeonly buffer Records { vec4 records[]; };
layout(std430, set = 0, binding = 7) writeonly buffer Terms { LmTerm terms[]; };
layout(std430, set = 0, binding = 8) readonly buffer States { LmState states[2]; };
#include "lm_group_sum.glsl"

// A residual's rows as the normal equations want them: G and b of lm.glsl, not yet weighted.
struct Rows {
    mat3 squares;
    vec3 pull;
};
const Rows kNoRows = Rows(mat3(0.0), vec3(0));
void add_row(inout Rows rows, vec3 gradient, float value) {
    rows.squares += outerProduct(gradient, gradient);
    rows.pull += value * gradient;
}

void store(uint item, Rows rows, float weight) {
    const mat3 g = rows.squares * weight;
    records[kRecordVectors * item] = vec4(g[0], weight);
    records[kRecordVectors * item + 1] = vec4(g[1].yz, g[2].z, 0);
    records[kRecordVectors * item + 2] = vec4(rows.pull * weight, 0);
}

DualQuaternion motion_of(uint item) {
    DualQuaternion moved_by[4];
    float weight[4];
    for (int k = 0; k < 4; ++k) {
        const uint node = uint(item_nodes[item][k]);
        moved_by[k] = DualQuaternion(trial[kNodeVectors * node], trial[kNodeVectors * node + 1]);
        weight[k] = items[kItemVectors * item + 2 + k].w;
    }
    return blend(moved_by, weight);
}

// A residual of squared size `squared` in the term's unit.
LmTerm count_residual(Robust robust, float weight, float squared) {
    const bool counts = robust.weight * weight > 0.0;
    return LmTerm(weight * robust.cost, counts ? robust.weight : 0.0,
                  counts ? robust.weight * squared : 0.0, counts ? 1 : 0, 0);
}

LmTerm evaluate_point(uint item) {
    const DualQuaternion motion = motion_of(item);
    const vec3 position = apply(motion, items[kItemVectors * item].xyz),
               normal = rotate(motion, items[kItemVectors * item + 1].xyz);
    vec2 pixel;
    float depth = 0.0;
    if (project_inside(push.camera, run.image, position, pixel))
        depth = live_depth(push.camera, run.image, pixel);
    const float range = sqrt(dot(position, position)), slope = dot(normal, position);
    const float difference = (depth - position.z) / position.z;
    const bool associated =
        depth > 0.0 && -slope >= kMinFacing * range && abs(difference) * range <= push.association;
    if (!associated) {
        store(item, kNoRows, 0.0);
        return LmTerm(0, 0, 0, 0, 1);
    }
    const float value = difference * slope;
    const Robust robust = tukey(value * value, 1.0 / (push.icp_tukey * push.icp_tukey));
    Rows rows = kNoRows;
    add_row(rows, -normal, value);
    store(item, rows, push.icp_weight * robust.weight);
    return count_residual(robust, push.icp_weight, value * value);
}

// Where a point was seen: the direction of its ray, the Cholesky factor [uu 0; uv vv] of the
// information across it, and maybe the depth.
struct Sighting {
    float u, v, uu, uv, vv, depth, root;
};

// Tukey's kernel, and with slope > 0 the paper's ramp 1 - slope * d.
Robust ramped_tukey(float squared, float slope, float inverse_c2) {
    const float farthest = 1.0 / max(slope, sqrt(inverse_c2));
    const bool beyond = !finite(squared) || squared >= farthest * farthest;
    const float d = beyond ? farthest : sqrt(squared), d2 = d * d;
    const float x = d2 * inverse_c2, rest = 1.0 - x;
    const float lost = 2.0 * d * slope * (1.0 / 3.0 - x * (2.0 / 5.0) + x * x / 7.0);
    return Robust(d2 * (1.0 - x + x * x / 3.0 - lost),
                  beyond ? 0.0 : (1.0 - slope * d) * rest * rest);
}

// unit: of the residual in the summary, per mm.
LmTerm evaluate_sighting(uint item, vec3 position, Sighting seen, float weight, float slope,
                         float inverse_c2, float unit) {
    const float across = position.x - seen.u * position.z, down = position.y - seen.v * position.z;
    const vec3 value = vec3(seen.uu * across + seen.uv * down, seen.vv * down,
                            seen.root * (position.z - seen.depth));
    const float squared = dot(value, value);
    const Robust robust = ramped_tukey(squared, slope, inverse_c2);
    Rows rows = kNoRows;
    if (robust.weight > 0.0) {
        add_row(rows, vec3(seen.uu, seen.uv, -(seen.uu * seen.u + seen.uv * seen.v)), value.x);
        add_row(rows, vec3(0, seen.vv, -seen.vv * seen.v), value.y);
        add_row(rows, vec3(0, 0, seen.root), value.z);
    }
    store(item, rows, weight * robust.weight);
    return count_residual(robust, weight, squared * unit * unit);
}

LmTerm evaluate_match(uint item, uint i) {
    if ((run.given & kMatchesGiven) == 0 || !has_depth(matches[i])) {
        store(item, kNoRows, 0.0);
        return kNoTerm;
    }
    const Match match = matches[i];
    const vec3 live = load3(match.position);
    const bool chosen = match.weight > 0.0;
    const vec3 position = apply(motion_of(item), items[kItemVectors * item].xyz);
    return evaluate_sighting(
        item, position,
        Sighting(live.x / live.z, live.y / live.z, 1.0, 0.0, 1.0, live.z, sqrt(kMatchDepthWeight)),
        push.match_weight * (chosen ? match.weight : 1.0), chosen ? 0.0 : push.match_slope,
        1.0 / (push.match_tukey * push.match_tukey), 1.0);
}

// uu, uv and vv of a sighting: the Cholesky factor of the information matrix (a b; b c), which is
// scaled down where it is more than 1 along some direction. False where there is none. As
// patch_sighting of backends/shared/lm_terms.hpp.
bool factor_information(float given[3], out vec3 factor) {
    factor = vec3(0);
    vec3 abc = load3(given);
    float one = 1.0;
    // Squares of numbers beyond may overflow.
    if (!all(lessThanEqual(abs(abc), vec3(kEnlarge / 16.0)))) {
        abc *= kReduce;
        one = kReduce;
    }
    const float half_difference = 0.5 * (abc.x - abc.z);
    const float largest =
        0.5 * (abc.x + abc.z) + sqrt(half_difference * half_difference + abc.y * abc.y);
    if (!finite(largest) || !(largest > 0.0) || !(abc.x >= 0.0) || !(abc.z >= 0.0)) return false;
    abc *= 1.0 / max(largest, one);
    const float uu = sqrt(abc.x), uv = uu > 0.0 ? abc.y / uu : 0.0;
    factor = vec3(uu, uv, sqrt(max(abc.z - uv * uv, 0.0)));
    return true;
}

LmTerm evaluate_patch(uint item, uint i) {
    vec3 factor;
    if ((run.given & kObservationsGiven) == 0 || observations[i].valid != 1 ||
        !factor_information(observations[i].information, factor)) {
        store(item, kNoRows, 0.0);
        return kNoTerm;
    }
    const PatchObservation observation = observations[i];
    const vec2 ray = (vec2(observation.u, observation.v) / float(kPatchOne) -
                      vec2(push.camera.cx, push.camera.cy)) /
                     vec2(push.camera.fx, push.camera.fy);
    const vec3 position = apply(motion_of(item), items[kItemVectors * item].xyz);
    const float px = push.camera.fx / max(position.z, kMinDepthMm),
                inverse_c = px / push.patch_tukey;
    return evaluate_sighting(item, position,
                             Sighting(ray.x, ray.y, factor.x, factor.y, factor.z, 0.0, 0.0),
                             push.patch_weight, 0.0, inverse_c * inverse_c, px);
}

void main() {
    if (run.evaluation > 0 && stopped(states[(run.evaluation - 1) & 1])) return;
    const uint me = gl_LocalInvocationIndex, i = gl_GlobalInvocationID.x;
    LmTerm own = kNoTerm;
    if (kKind == kPoints) {
        if (i < push.points) own = evaluate_point(i);
    } else if (kKind == kLandmarks) {
        if (i < push.landmarks) own = evaluate_match(push.points + i, i);
    } else {
        if (i < push.patches) own = evaluate_patch(push.points + push.landmarks + i, i);
    }
    own = sum_over_group(own, me);
    if (me == 0) terms[groups_before(kKind) + gl_WorkGroupID.x] = own;
}
