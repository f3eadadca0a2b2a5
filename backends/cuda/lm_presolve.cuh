// Stage lm, section 4: the rigid motion that brings the deformed landmarks onto their preselected
// matches. One block, after many have deformed them.
#pragma once
#include "backends/cuda/lm_memory.cuh"
#include "backends/cuda/lm_sums.cuh"
#include "backends/cuda/ransac_rotation.cuh"

namespace defrec::cuda {
namespace {

struct LmPresolve {
    const float4* items;  // the landmarks among the template's
    const int4* item_nodes;
    uint32_t landmarks;
    float match_tukey;
    const defrec_motion* motions;
    const defrec_match* matches;
    float4* deformed;  // landmarks
    float4* rigid;     // rotation, translation
};

constexpr uint32_t kPresolveThreads = 256, kPresolveWarps = kPresolveThreads / kWarp,
                   kDeformThreads = 64;

// Whether the second singular value is certainly above a bound: the sum of the squared 2x2 minors
// is at most three times the product of the two largest squared singular values.
__device__ __forceinline__ bool spreads_beyond(const float (&m)[9], float bound) {
    const Vec3<float> a{m[0], m[1], m[2]}, b{m[3], m[4], m[5]}, c{m[6], m[7], m[8]};
    const Vec3<float> ab = cross(a, b), bc = cross(b, c), ca = cross(c, a);
    const float minors = dot(ab, ab) + dot(bc, bc) + dot(ca, ca),
                all = dot(a, a) + dot(b, b) + dot(c, c);
    return minors > 3 * bound * bound * all;
}

// By one-sided Jacobi rotations of the columns.
__device__ float second_singular_value(const float (&m)[9]) {
    constexpr int kSweeps = 6;  // at most: each squares the error
    Vec3<float> column[3] = {{m[0], m[3], m[6]}, {m[1], m[4], m[7]}, {m[2], m[5], m[8]}};
    const auto turn = [](Vec3<float>& p, Vec3<float>& q) {
        const Vec3<float> a = p, b = q;
        const float across = dot(a, b), aa = dot(a, a), bb = dot(b, b);
        if (!(std::abs(across) > 1e-9f * (aa + bb))) return false;
        const float theta = (bb - aa) / (2 * across);
        const float t =
            (theta < 0 ? -1.0f : 1.0f) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const float c = 1 / std::sqrt(t * t + 1), s = t * c;
        p = c * a - s * b;
        q = s * a + c * b;
        return true;
    };
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
        bool turned = turn(column[0], column[1]);
        turned |= turn(column[0], column[2]);
        turned |= turn(column[1], column[2]);
        if (!turned) break;
    }
    float length[3];
    for (int i = 0; i < 3; ++i) length[i] = std::sqrt(dot(column[i], column[i]));
    return fmaxf(fminf(length[0], length[1]), fminf(fmaxf(length[0], length[1]), length[2]));
}

// Weighted sums over the matches, from and to each about a point of their own.
enum LmFitSumOf : uint32_t { kFitFrom, kFitTo = 3, kFitMoment = 6, kFitWeight = 15, kFitSums };
// Sums over all preselected matches.
enum LmMatchSumOf : uint32_t {
    kMatchFrom,
    kMatchTo = 3,
    kMatchCount = 6,
    kMatchWeights,
    kMatchErrors,
    kMatchCost,
    kMatchSums = 16
};

struct RigidMotion {
    Quaternion<float> rotation;
    Vec3<float> shift;
};
__device__ __forceinline__ Vec3<float> moved_by(const RigidMotion& motion, Vec3<float> p) {
    return rotate(motion.rotation, p) + motion.shift;
}

__device__ __forceinline__ void add3(float* sums, float weight, Vec3<float> v) {
    sums[0] += weight * v.x;
    sums[1] += weight * v.y;
    sums[2] += weight * v.z;
}
__device__ __forceinline__ Vec3<float> mean3(const float* sums, float weight) {
    return {sums[0] / weight, sums[1] / weight, sums[2] / weight};
}

// Deforms all landmarks, since it is known early where they are, and later which of them are
// matched.
__global__ void __launch_bounds__(kDeformThreads) lm_deform(LmPresolve given) {
    const uint32_t i = blockIdx.x * kDeformThreads + threadIdx.x;
    if (i >= given.landmarks) return;
    const float4* vectors = given.items + LmLists::kItemVectors * size_t{i};
    const int4 nodes = given.item_nodes[i];
    const int32_t node[DEFREC_BLEND_NODES] = {nodes.x, nodes.y, nodes.z, nodes.w};
    float weight[DEFREC_BLEND_NODES];
    for (uint32_t k = 0; k < DEFREC_BLEND_NODES; ++k) weight[k] = vectors[LmLists::kItemArms + k].w;
    const auto motion = blend_with<float>(
        [&given](int32_t k) { return usable_motion<float>(given.motions[k]); }, node, weight);
    given.deformed[i] = pack(apply(motion, vector_of(vectors[0])), 0);
}

// A preselected match: where its landmark is deformed to, and where it was seen; weight 0: none.
struct LmPull {
    Vec3<float> from{}, to{};
    float weight = 0;
};
__device__ __forceinline__ LmPull pull_of(const LmPresolve& given, uint32_t i) {
    const defrec_match match = given.matches[i];
    return {vector_of(given.deformed[i]), load3<float>(match.position),
            preselected(match) ? match.weight : 0};
}

// The first of them are kept in registers.
struct LmPulls {
    static constexpr uint32_t kHeld = 4;  // of a thread
    LmPull held[kHeld];

    __device__ explicit LmPulls(const LmPresolve& given) {
        for (uint32_t k = 0; k < kHeld; ++k) {
            const uint32_t i = k * kPresolveThreads + threadIdx.x;
            if (i < given.landmarks) held[k] = pull_of(given, i);
        }
    }
    template <class Use>
    __device__ void each(const LmPresolve& given, Use&& use) const {
        const auto use_it = [&use](const LmPull& pull) {
            if (pull.weight > 0) use(pull);
        };
        for (const LmPull& pull : held) use_it(pull);
        for (uint32_t i = kHeld * kPresolveThreads + threadIdx.x; i < given.landmarks;
             i += kPresolveThreads)
            use_it(pull_of(given, i));
    }
};

// The best motion by the sums of a round, by every thread for itself.
__device__ __forceinline__ RigidMotion fit(const float (&sums)[kFitSums], Vec3<float> from_centre,
                                           Vec3<float> to_centre) {
    if (!(sums[kFitWeight] > 0)) return {{1, 0, 0, 0}, {0, 0, 0}};
    const Vec3<float> from = mean3(sums + kFitFrom, sums[kFitWeight]),
                      to = mean3(sums + kFitTo, sums[kFitWeight]);
    const float a[3] = {from.x, from.y, from.z}, b[3] = {to.x, to.y, to.z};
    float moment[9];
    for (int i = 0; i < 9; ++i)
        moment[i] = sums[kFitMoment + i] / sums[kFitWeight] - b[i / 3] * a[i % 3];
    constexpr auto kMinSpread = static_cast<float>(kMinSpreadMm2);
    Quaternion<float> turn{1, 0, 0, 0};
    if (spreads_beyond(moment, kMinSpread) || second_singular_value(moment) > kMinSpread) {
        const float4 q = nearest_quaternion(moment);
        turn = {q.w, q.x, q.y, q.z};
    }
    return {turn, to_centre + to - rotate(turn, from_centre + from)};
}

__global__ void __launch_bounds__(kPresolveThreads) lm_presolve(LmPresolve given) {
    __shared__ float match_warps[kPresolveWarps][kMatchSums], fit_warps[kPresolveWarps][kFitSums],
        error_warps[kPresolveWarps][2];
    const float c2 = given.match_tukey * given.match_tukey;
    const LmPulls pulls(given);
    float all[kMatchSums] = {};
    pulls.each(given, [&](const LmPull& pull) {
        const float squared = dot(pull.from - pull.to, pull.from - pull.to);
        add3(all + kMatchFrom, 1, pull.from);
        add3(all + kMatchTo, 1, pull.to);
        all[kMatchCount] += 1;
        all[kMatchWeights] += pull.weight;
        all[kMatchErrors] += pull.weight * squared;
        all[kMatchCost] += pull.weight * tukey(squared, 1 / c2).cost;
    });
    block_sums(all, match_warps);
    RigidMotion motion{{1, 0, 0, 0}, {0, 0, 0}};
    float errors[2] = {
        all[kMatchErrors],
        all[kMatchCost]};  // under the present motion: weighted squares, Tukey's cost
    const bool enough = all[kMatchCount] >= static_cast<float>(kPresolveMinMatches);
    const Vec3<float> from_centre = mean3(all + kMatchFrom, all[kMatchCount]),
                      to_centre = mean3(all + kMatchTo, all[kMatchCount]);
    for (int round = 0; enough && round < kPresolveRounds; ++round) {
        const float inverse_c2 =
            1 / fmaxf(c2, static_cast<float>(kPresolveMinWidth2) * errors[0] / all[kMatchWeights]);
        float sums[kFitSums] = {};
        pulls.each(given, [&](const LmPull& pull) {
            const Vec3<float> off = moved_by(motion, pull.from) - pull.to;
            const float weight = pull.weight * tukey(dot(off, off), inverse_c2).weight;
            const Vec3<float> a = pull.from - from_centre, b = pull.to - to_centre;
            add3(sums + kFitFrom, weight, a);
            add3(sums + kFitTo, weight, b);
            add3(sums + kFitMoment, weight * b.x, a);
            add3(sums + kFitMoment + 3, weight * b.y, a);
            add3(sums + kFitMoment + 6, weight * b.z, a);
            sums[kFitWeight] += weight;
        });
        block_sums(sums, fit_warps);
        motion = fit(sums, from_centre, to_centre);
        const float before = errors[0];
        errors[0] = errors[1] = 0;
        pulls.each(given, [&](const LmPull& pull) {
            const Vec3<float> off = moved_by(motion, pull.from) - pull.to;
            errors[0] += pull.weight * dot(off, off);
            errors[1] += pull.weight * tukey(dot(off, off), 1 / c2).cost;
        });
        block_sums(errors, error_warps);
        if (fabsf(errors[0] - before) <= kPresolveMinChange * before) break;
    }
    if (threadIdx.x != 0) return;
    const bool closer = enough && errors[1] < all[kMatchCost];
    given.rigid[0] = closer ? pack(motion.rotation) : make_float4(1, 0, 0, 0);
    given.rigid[1] = closer ? pack(motion.shift, 0) : make_float4(0, 0, 0, 0);
}

}  // namespace
}  // namespace defrec::cuda
