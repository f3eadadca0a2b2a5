// Residuals of items and connections by the trial poses, a thread each: their sums, and what the
// system wants of them.
#pragma once
#include "backends/cuda/lm_memory.cuh"
#include "backends/cuda/lm_sums.cuh"
#include "backends/shared/lm_arap.hpp"

namespace defrec::cuda {
namespace {

// A residual in the normal equations: see kArms and what follows it.
struct NormalTerm {
    float squares[6];
    Vec3<float> pull;
    float weight;
};

__device__ __forceinline__ void add_row(const Row<float>& row, float weight, NormalTerm& term) {
    const Vec3<float> g = row.gradient, w = weight * g;
    const float squares[6] = {w.x * g.x, w.x * g.y, w.x * g.z, w.y * g.y, w.y * g.z, w.z * g.z};
    for (int i = 0; i < 6; ++i) term.squares[i] += squares[i];
    term.pull = term.pull + row.value * w;
}

// A residual of squared size `squared`, in the summary's unit, enters the sums; returns its weight
// in the system.
template <uint32_t kTerm>
__device__ __forceinline__ float count_residual(const Robust<float>& robust, float weight,
                                                float squared, bool counted, float (&sums)[kSums]) {
    const float total = weight * robust.weight;
    if (counted) {
        sums[kTerm] += weight * robust.cost;
        if (total > 0) {
            sums[kWeights + kTerm] += robust.weight;
            sums[kResidualSquares + kTerm] += robust.weight * squared;
            sums[kCounts + kTerm] += 1;
        }
    }
    return total > 0 ? total : 0.0f;
}

// How a sighting counts: its weight without ramped_tukey, the widths of that, and the unit of the
// residual in the summary, per mm.
struct SightingWeight {
    float weight, inverse_a, inverse_c2, unit;
};

template <uint32_t kTerm>
__device__ __forceinline__ void evaluate_sighting(Vec3<float> position, const Sighting<float>& seen,
                                                  const SightingWeight& given, bool counted,
                                                  float (&sums)[kSums], NormalTerm& term) {
    Row<float> rows[3];
    sighting_rows(position, seen, rows);
    const float squared = rows[0].value * rows[0].value + rows[1].value * rows[1].value +
                          rows[2].value * rows[2].value;
    term.weight =
        count_residual<kTerm>(ramped_tukey(squared, given.inverse_a, given.inverse_c2),
                              given.weight, squared * given.unit * given.unit, counted, sums);
    if (!(term.weight > 0)) return;
    for (const Row<float>& row : rows) add_row(row, term.weight, term);
}

__device__ __forceinline__ void evaluate_point(const LmView& view,
                                               const DualQuaternion<float>& motion,
                                               const float4* item, bool counted,
                                               float (&sums)[kSums], NormalTerm& term) {
    const LmParameters& p = view.p;
    Row<float> row{};
    if (!icp_row(p.exact_camera, p.image, p.association, apply(motion, vector_of(item[0])),
                 rotate(motion, vector_of(item[1])), row)) {
        if (counted) sums[kWithoutSurface] += 1;
        return;
    }
    const float squared = row.value * row.value;
    term.weight = count_residual<kIcp>(tukey(squared, 1 / (p.icp_tukey * p.icp_tukey)),
                                       p.icp_weight, squared, counted, sums);
    if (term.weight > 0) add_row(row, term.weight, term);
}

__device__ __forceinline__ void evaluate_match(const LmView& view, uint32_t landmark,
                                               Vec3<float> position, bool counted,
                                               float (&sums)[kSums], NormalTerm& term) {
    const LmParameters& p = view.p;
    const defrec_match& match = view.frame.matches[landmark];
    if (!has_depth(match)) return;
    const bool preselected = match.weight > 0;
    const SightingWeight weight{.weight = p.match_weight * (preselected ? match.weight : 1.0f),
                                .inverse_a = preselected ? 0.0f : p.match_slope,
                                .inverse_c2 = 1 / (p.match_tukey * p.match_tukey),
                                .unit = 1};
    evaluate_sighting<kMatch>(position, match_sighting(load3<float>(match.position)), weight,
                              counted, sums, term);
}

__device__ __forceinline__ void evaluate_patch(const LmView& view, uint32_t patch,
                                               Vec3<float> position, bool counted,
                                               float (&sums)[kSums], NormalTerm& term) {
    const LmParameters& p = view.p;
    Sighting<float> sighting{};
    if (!patch_sighting(p.exact_camera, view.frame.observations[patch], sighting)) return;
    const float px = px_per_mm(p.exact_camera, position.z), inverse_c = px / p.patch_tukey;
    const SightingWeight weight{
        .weight = p.patch_weight, .inverse_a = 0, .inverse_c2 = inverse_c * inverse_c, .unit = px};
    evaluate_sighting<kPatch>(position, sighting, weight, counted, sums, term);
}

// The one at that place in the list of items. Its record goes to slot, if wanted.
__device__ __forceinline__ void evaluate_item(const LmView& view, const LmMemory& memory,
                                              uint32_t which, uint32_t slot, bool record,
                                              float (&sums)[kSums]) {
    const uint32_t given = view.surface.items[which], item = given & ~kLmUncounted;
    const bool counted = (given & kLmUncounted) == 0;
    const LmParameters& p = view.p;
    const float4* vectors = view.surface.item_vectors + LmLists::kItemVectors * size_t{which};
    const uint4 nodes = view.surface.item_nodes[which];
    const int32_t node[DEFREC_BLEND_NODES] = {
        static_cast<int32_t>(nodes.x), static_cast<int32_t>(nodes.y), static_cast<int32_t>(nodes.z),
        static_cast<int32_t>(nodes.w)};
    float4 arms[DEFREC_BLEND_NODES];
    float weight[DEFREC_BLEND_NODES];
    for (int k = 0; k < DEFREC_BLEND_NODES; ++k) {
        arms[k] = vectors[LmLists::kItemArms + k];
        weight[k] = arms[k].w;
    }
    const auto motion = blend_with<float>(
        [&memory](int32_t k) {
            return DualQuaternion<float>{quaternion_of(memory.poses[kPose * k]),
                                         quaternion_of(memory.poses[kPose * k + 1])};
        },
        node, weight);

    NormalTerm term{};
    if (item < p.points) {
        evaluate_point(view, motion, vectors, counted, sums, term);
    } else if (item < p.points + p.landmarks) {
        if (view.frame.matches != nullptr)
            evaluate_match(view, item - p.points, apply(motion, vector_of(vectors[0])), counted,
                           sums, term);
    } else if (view.frame.observations != nullptr) {
        evaluate_patch(view, item - p.points - p.landmarks, apply(motion, vector_of(vectors[0])),
                       counted, sums, term);
    }
    if (!record) return;
    float4* out = memory.records + kRecord * slot;
    const auto& [xx, xy, xz, yy, yz, zz] = term.squares;
    const Vec3<float> columns[3] = {{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}};
    for (uint32_t i = 0; i < 3; ++i) out[kShifts + i] = pack(columns[i], 0);
    out[kPull] = pack(term.pull, 0);
    out[kWeight] = make_float4(term.weight, 0, 0, 0);
    for (uint32_t k = 0; k < DEFREC_BLEND_NODES; ++k) {
        const Vec3<float> arm =
            rotate(quaternion_of(memory.poses[kPose * node[k]]), vector_of(arms[k]));
        out[kArms + k] = pack(weight[k] * arm, weight[k]);
        out[kTurns + 3 * k] = pack(arm.y * columns[2] - arm.z * columns[1], 0);
        out[kTurns + 3 * k + 1] = pack(arm.z * columns[0] - arm.x * columns[2], 0);
        out[kTurns + 3 * k + 2] = pack(arm.x * columns[1] - arm.y * columns[0], 0);
    }
}

__device__ __forceinline__ NodePose<float> pose_of(const LmMemory& memory, uint32_t node) {
    return {quaternion_of(memory.poses[kPose * node]), vector_of(memory.poses[kPose * node + 2])};
}

// An edge from i's side. Its record goes to slot, and the block between the two to the matrix.
__device__ __forceinline__ void evaluate_connection(const LmView& view, const LmMemory& memory,
                                                    uint32_t which, uint32_t slot, bool record,
                                                    float (&sums)[kSums]) {
    const LmParameters& p = view.p;
    const LmConnection& connection = view.surface.connections[which];
    const NodePose<float> i = pose_of(memory, connection.i), j = pose_of(memory, connection.j);
    const float scale = view.exchange.scales[which];
    const Vec3<float> direction{connection.rest[0], connection.rest[1], connection.rest[2]};
    const auto geometry = arap_geometry(i, j, direction, connection.rest[3]);
    const ArapWeights<float> weights{scale * p.length_weight, scale * p.angle_weight,
                                     scale * p.rotation_weight};
    if ((connection.place & kLmUncounted) == 0)
        sums[kArap] += arap_cost(geometry, i.rotation, weights);
    if (!record) return;
    const ArapTerm<float> term = arap_term(geometry, i.rotation, weights);
    const auto store = [&memory, slot](uint32_t component, float value) {
        memory.connection_records[component * memory.connection_slots + slot] = value;
    };
    constexpr uint32_t kUpper[6] = {0, 1, 2, 7, 8, 14};
    for (uint32_t k = 0; k < 6; ++k) {
        store(kTurn + k, term.aa[kUpper[k]]);
        store(kShift + k, term.aa[21 + kUpper[k]]);
        store(kGradient + k, term.gradient_a[k]);
    }
    for (uint32_t r = 0; r < 3; ++r)
        for (uint32_t c = 0; c < 3; ++c) store(kLever + 3 * r + c, term.aa[6 * r + 3 + c]);
    float* block = memory.matrix + 36 * size_t{connection.place & ~kLmUncounted};
    for (uint32_t k = 0; k < 36; ++k) block[k] += term.ab[k];
}

}  // namespace
}  // namespace defrec::cuda
