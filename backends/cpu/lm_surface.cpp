// The data terms of stage lm over groups of surface points, in SIMD lanes. The formulas are those
// of backends/shared/lm_terms.hpp.
#include <hwy/cache_control.h>

#include "backends/cpu/lm_groups.hpp"
#include "backends/cpu/lm_system.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/lm_surface.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/highway.h>

#include "backends/cpu/lm_normal_equations-inl.hpp"
#include "backends/cpu/surface_lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {

using D = hn::CappedTag<float, kGroupLanes>;
using DWide = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;

HWY_INLINE float total(V v) { return hn::GetLane(hn::SumOfLanes(D(), v)); }

// A term's sums, lane by lane.
struct TermLanes {
    V cost, weights, squares;
    int32_t count = 0;

    HWY_INLINE TermLanes() : cost(hn::Zero(D())), weights(cost), squares(cost) {}
    HWY_INLINE void add(hn::Mask<D> here, V lane_cost, V weight, V square) {
        const D d;
        cost = hn::Add(cost, hn::IfThenElseZero(here, lane_cost));
        const V shared = hn::IfThenElseZero(here, weight);
        weights = hn::Add(weights, shared);
        squares = hn::MulAdd(shared, square, squares);
        count += int32_t(hn::CountTrue(d, hn::Gt(shared, hn::Zero(d))));
    }
    HWY_INLINE LmGroupSums::Term sums() const {
        return {total(cost), total(weights), total(squares), count};
    }
};

template <bool kUpper, class D, class V = hn::Vec<D>>
HWY_INLINE hn::Vec<D4> four_of([[maybe_unused]] D d, V v) {
    if constexpr (hn::MaxLanes(D()) == 4)
        return v;
    else if constexpr (kUpper)
        return hn::UpperHalf(D4(), v);
    else
        return hn::LowerHalf(D4(), v);
}
template <bool kUpper, class D, class V = hn::Vec<D>>
HWY_INLINE void store_four(D d, const V* entry, V residual, float* out) {
    for (size_t g = 0; g < kPieces; ++g)
        hn::StoreInterleaved4(four_of<kUpper>(d, entry[4 * g]),
                              four_of<kUpper>(d, entry[4 * g + 1]),
                              four_of<kUpper>(d, entry[4 * g + 2]),
                              four_of<kUpper>(d, entry[4 * g + 3]), D4(), out + 16 * g);
    const auto zero = hn::Zero(D4());
    hn::StoreInterleaved4(four_of<kUpper>(d, residual), zero, zero, zero, D4(), out + 16 * kPieces);
}

// A residual's derivative by the increments of the four control points is their weight times (arm x
// gradient, gradient).
struct Levers {
    Lanes3<V> arm[kBlendNodes];
    V weight[kBlendNodes];

    HWY_INLINE Levers(const NodeMotion* motions, const std::array<int32_t, kBlendNodes>& node,
                      const Lanes3<V>& rest, const V* weights) {
        const D d;
        for (size_t k = 0; k < kBlendNodes; ++k) {
            const NodeMotion& motion = motions[node[k]];
            const Lanes3<V> from =
                subtract(rest, {hn::Set(d, motion.rest[0]), hn::Set(d, motion.rest[1]),
                                hn::Set(d, motion.rest[2])});
            const auto row = [&](size_t r) HWY_ATTR {
                return dot(Lanes3<V>{hn::Set(d, motion.rotation[3 * r]),
                                     hn::Set(d, motion.rotation[3 * r + 1]),
                                     hn::Set(d, motion.rotation[3 * r + 2])},
                           from);
            };
            arm[k] = {row(0), row(1), row(2)};
            weight[k] = weights[k];
        }
    }
    // The rows of one vector, in fours, as lm_normal_equations-inl.hpp wants them.
    HWY_INLINE void store(const Lanes3<V>& gradient, V residual, size_t fours, float* out) const {
        V entry[kJacobian];
        for (size_t k = 0; k < kBlendNodes; ++k) {
            const Lanes3<V> shift = scale(weight[k], gradient), turn = cross(arm[k], shift);
            const V six[6] = {turn.x, turn.y, turn.z, shift.x, shift.y, shift.z};
            for (size_t i = 0; i < 6; ++i) entry[6 * k + i] = six[i];
        }
        store_four<false>(D(), entry, residual, out);
        if (fours > 1) store_four<true>(D(), entry, residual, out + kFourRows);
    }
};

// The rows of a group so far, and the weight of its data at each control point.
struct Rows {
    float* out;
    size_t fours = 0;
    V data[kBlendNodes];

    HWY_INLINE explicit Rows(float* where) : out(where) {
        for (V& sum : data) sum = hn::Zero(D());
    }
    // Those of the first `used` lanes.
    HWY_INLINE void add(const Levers& levers, const Lanes3<V>& gradient, V residual, size_t used) {
        const size_t more = (std::min(used, hn::Lanes(D())) + 3) / 4;
        levers.store(gradient, residual, more, out + fours * kFourRows);
        fours += more;
    }
    HWY_INLINE void add_data(const V* blend_weights, V weight) {
        for (size_t k = 0; k < kBlendNodes; ++k)
            data[k] = hn::MulAdd(blend_weights[k], weight, data[k]);
    }
};

// first: which of the group's control points each item names first.
HWY_INLINE MotionLanes<V> motion_of(const LmGroupTask& task, const LmGroup& group,
                                    const GroupMotion& motions, const V weight[kBlendNodes],
                                    const float* first) {
    return HWY_LIKELY(motions.together)
               ? blend_lanes(D(), motions, weight)
               : blend_lanes_apart(D(), task.motions, group.node, weight, first);
}

// Point to plane.
HWY_NOINLINE void sum_points(const LmGroupTask& task, const LmGroup& group,
                             const GroupMotion& motions, Rows& rows, LmGroupSums& sums) {
    const D d;
    const size_t lanes = hn::Lanes(d);
    const LmGroups& groups = *task.groups;
    const V one = hn::Set(d, 1.0f), zero = hn::Zero(d);
    const float c2 = task.params->icp_tukey_mm * task.params->icp_tukey_mm;
    const V full_cost = hn::Set(d, task.params->icp_weight * c2 / 3),
            term_weight = hn::Set(d, task.params->icp_weight);
    TermLanes term;
    size_t missing = 0;
    for (size_t i = 0; i < group.points; i += lanes) {
        const auto load = [&](int component) HWY_ATTR {
            return hn::Load(d, groups.point(component) + group.first_point + i);
        };
        const V blend_weights[kBlendNodes] = {load(LmGroups::kWeight), load(LmGroups::kWeight + 1),
                                              load(LmGroups::kWeight + 2),
                                              load(LmGroups::kWeight + 3)};
        const auto motion = motion_of(task, group, motions, blend_weights,
                                      groups.point(LmGroups::kFirst) + group.first_point + i);
        const Lanes3<V> rest{load(LmGroups::kX), load(LmGroups::kY), load(LmGroups::kZ)};
        const Lanes3<V> p = motion.point(rest);
        const Lanes3<V> n = motion.direction(Lanes3<V>{
            load(LmGroups::kNormalX), load(LmGroups::kNormalY), load(LmGroups::kNormalZ)});

        const auto live = depth_lanes(d, task.params->camera, task.image, p);
        hn::Store(live.offset, hn::Rebind<int32_t, D>(), task.offsets + group.first_point + i);
        const V range = hn::Sqrt(dot(p, p)), slope = dot(n, p);
        const V difference = hn::Mul(hn::Sub(live.depth, p.z), live.inverse_z);
        const auto facing = hn::Ge(hn::Neg(slope), hn::Mul(hn::Set(d, float(kMinFacing)), range));
        const auto close =
            hn::Le(hn::Mul(hn::Abs(difference), range), hn::Set(d, task.params->association_mm));
        const auto exists = hn::FirstN(d, group.points - i);
        const auto seen = hn::And(hn::And(live.known, exists), hn::And(facing, close));
        missing += std::min<size_t>(lanes, group.points - i) - hn::CountTrue(d, seen);

        const V residual = hn::IfThenElseZero(seen, hn::Mul(difference, slope));
        const V squared = hn::Mul(residual, residual);
        const V left = hn::Sub(one, hn::Min(hn::Mul(squared, hn::Set(d, 1 / c2)), one));
        const V robust = hn::Mul(left, left);
        term.add(seen, hn::Mul(full_cost, hn::NegMulAdd(robust, left, one)), robust, squared);
        if (!task.linearise) continue;

        const V weight = hn::IfThenElseZero(seen, hn::Mul(term_weight, robust));
        if (hn::AllTrue(d, hn::Le(weight, zero))) continue;
        const V root = hn::Sqrt(weight);
        const Lanes3<V> gradient = scale(hn::Neg(root), n);
        rows.add(Levers(task.motions, group.node, rest, blend_weights), gradient,
                 hn::Mul(root, residual), group.points - i);
        rows.add_data(blend_weights, weight);
    }
    sums.icp = term.sums();
    sums.missing = float(missing) * task.params->icp_weight * c2 / 3;
}

// ramped_tukey of lm_terms.hpp.
struct RobustLanes {
    hn::Mask<D> within;  // elsewhere the weight is 0
    V weight, cost;
};
HWY_INLINE RobustLanes ramped_tukey_lanes(V squared, V inverse_a, V inverse_c2) {
    const D d;
    const V one = hn::Set(d, 1.0f), zero = hn::Zero(d);
    const V ends = hn::Max(inverse_a, hn::Sqrt(inverse_c2));
    const V farthest = hn::Div(one, ends);
    const auto within = hn::Lt(squared, hn::Mul(farthest, farthest));
    const V distance = hn::IfThenElse(within, hn::Sqrt(squared), farthest);
    const V d2 = hn::Mul(distance, distance), x = hn::Mul(d2, inverse_c2), left = hn::Sub(one, x);
    const V slant = hn::Mul(distance, inverse_a);
    const V lost = hn::Mul(
        hn::Add(slant, slant),
        hn::MulAdd(x, hn::MulSub(x, hn::Set(d, 1.0f / 7), hn::Set(d, 0.4f)), hn::Set(d, 1.0f / 3)));
    return {
        within,
        hn::IfThenElseZero(within,
                           hn::Mul(hn::Max(hn::Sub(one, slant), zero), hn::Mul(left, left))),
        hn::Mul(d2, hn::Sub(hn::MulAdd(x, hn::MulSub(x, hn::Set(d, 1.0f / 3), one), one), lost))};
}

// Matches and patches.
HWY_NOINLINE void sum_sightings(const LmGroupTask& task, const LmGroup& group,
                                const GroupMotion& motions, Rows& rows, LmGroupSums& sums) {
    const D d;
    const size_t lanes = hn::Lanes(d);
    const LmGroups& groups = *task.groups;
    const V zero = hn::Zero(d);
    TermLanes match, patch;
    for (size_t i = 0; i < group.sightings; i += lanes) {
        const auto load = [&](int component) HWY_ATTR {
            return hn::Load(d, groups.sighting(component) + group.first_sighting + i);
        };
        const V blend_weights[kBlendNodes] = {
            load(LmGroups::kSeenWeight), load(LmGroups::kSeenWeight + 1),
            load(LmGroups::kSeenWeight + 2), load(LmGroups::kSeenWeight + 3)};
        const auto motion =
            motion_of(task, group, motions, blend_weights,
                      groups.sighting(LmGroups::kSeenFirst) + group.first_sighting + i);
        const Lanes3<V> rest{load(LmGroups::kSeenX), load(LmGroups::kSeenY),
                             load(LmGroups::kSeenZ)};
        const Lanes3<V> p = motion.point(rest);
        const V u = load(LmGroups::kSeenU), v = load(LmGroups::kSeenV),
                uu = load(LmGroups::kSeenUU), uv = load(LmGroups::kSeenUV),
                vv = load(LmGroups::kSeenVV), root = load(LmGroups::kSeenRoot);
        const V across = hn::NegMulAdd(u, p.z, p.x), down = hn::NegMulAdd(v, p.z, p.y);
        const V r0 = hn::MulAdd(uu, across, hn::Mul(uv, down)), r1 = hn::Mul(vv, down);
        const V r2 = hn::Mul(root, hn::Sub(p.z, load(LmGroups::kSeenDepth)));
        const V squared = hn::MulAdd(r0, r0, hn::MulAdd(r1, r1, hn::Mul(r2, r2)));

        // A patch's c is in pixels.
        const V px = hn::Div(hn::Set(d, float(task.params->camera.fx)),
                             hn::Max(p.z, hn::Set(d, float(kMinDepthMm))));
        const V inverse_c2 =
            hn::MulAdd(load(LmGroups::kPxInverseC2), hn::Mul(px, px), load(LmGroups::kInverseC2));
        const RobustLanes robust =
            ramped_tukey_lanes(squared, load(LmGroups::kInverseA), inverse_c2);

        const V term_weight = load(LmGroups::kTermWeight);
        const auto exists = hn::Gt(term_weight, zero);
        const auto is_patch = hn::Gt(load(LmGroups::kIsPatch), zero);
        const V weighted = hn::Mul(term_weight, robust.cost);
        // Beyond the kernel it need not be finite.
        const V counted = hn::IfThenElseZero(robust.within, squared);
        match.add(hn::AndNot(is_patch, exists), weighted, robust.weight, counted);
        patch.add(hn::And(is_patch, exists), weighted, robust.weight,
                  hn::Mul(counted, hn::Mul(px, px)));
        if (!task.linearise) continue;

        const V weight = hn::Mul(term_weight, robust.weight), force = hn::Sqrt(weight);
        const Levers levers(task.motions, group.node, rest, blend_weights);
        const auto add_row = [&](const Lanes3<V>& gradient, V residual, size_t count) HWY_ATTR {
            rows.add(levers, scale(force, gradient),
                     hn::IfThenElseZero(robust.within, hn::Mul(force, residual)), count);
        };
        add_row({uu, uv, hn::Neg(hn::MulAdd(uu, u, hn::Mul(uv, v)))}, r0, group.sightings - i);
        add_row({zero, vv, hn::Neg(hn::Mul(vv, v))}, r1, group.sightings - i);
        // Only matches have depth.
        if (i < group.matches) add_row({zero, zero, root}, r2, group.matches - i);
        rows.add_data(blend_weights, weight);
    }
    sums.match = match.sums();
    sums.patch = patch.sums();
}

// The disparity image is larger than the inner caches, and points lie scattered over it: asks for
// where they were before they are looked up.
HWY_INLINE void prefetch_depth(const LmGroupTask& task, const LmGroup& group) {
    if (task.image.data == nullptr) return;
    const auto* upper = reinterpret_cast<const char*>(task.image.data);
    const char* lower = upper + task.image.stride * sizeof(int16_t);
    for (size_t i = group.first_point; i < group.first_point + group.points; ++i) {
        hwy::Prefetch(upper + task.offsets[i]);
        hwy::Prefetch(lower + task.offsets[i]);
    }
}

void SumGroups(const LmGroupTask& task, size_t first, size_t last) {
    constexpr size_t kAhead = 4;
    auto* equations = reinterpret_cast<NormalEquations*>(task.scratch);
    const auto groups = task.groups->groups();
    for (size_t g = first; g < last; ++g) {
        if (g + kAhead < last) prefetch_depth(task, groups[g + kAhead]);
        const LmGroup& group = groups[g];
        LmGroupSums& sums = task.sums[g];
        const GroupMotion motions(task.motions, group.node);
        Rows rows(task.scratch + sizeof(NormalEquations) / sizeof(float));
        sum_points(task, group, motions, rows, sums);
        sum_sightings(task, group, motions, rows, sums);
        if (!task.linearise) continue;
        for (size_t k = 0; k < kBlendNodes; ++k) sums.data[k] = total(rows.data[k]);
        multiply_rows(DWide(), rows.out, rows.fours, *equations);
        cut_blocks(*equations, sums);
    }
}

HWY_INLINE void add_block(const float* block, float* to) {
    const DWide d;
    const hn::FixedTag<float, 4> d4;
    size_t i = 0;
    for (; i + hn::Lanes(d) <= 36; i += hn::Lanes(d))
        hn::StoreU(hn::Add(hn::LoadU(d, to + i), hn::LoadU(d, block + i)), d, to + i);
    for (; i < 36; i += 4)
        hn::StoreU(hn::Add(hn::LoadU(d4, to + i), hn::LoadU(d4, block + i)), d4, to + i);
}

void AddGroups(const LmRowTask& task) {
    constexpr size_t kAhead = 2;
    for (size_t entry = 0; entry < task.entries.size(); ++entry) {
        if (entry + kAhead < task.entries.size()) {
            // Together the sums are larger than the inner caches.
            const auto [g, k] = task.entries[entry + kAhead];
            const float* first = task.sums[g].blocks[k * (k + 1) / 2];
            for (size_t i = 0; i <= 36 * (k + 1); i += 16) hwy::Prefetch(first + i);
        }
        const auto [g, k] = task.entries[entry];
        const auto& node = task.groups[g].node;
        const LmGroupSums& sums = task.sums[g];
        for (size_t l = 0, pair = size_t(k) * (k + 1) / 2; l <= k; ++l, ++pair) {
            if (l > 0 && node[l] == node[l - 1]) continue;
            add_block(sums.blocks[pair], (k == l ? task.diagonal : task.lower) +
                                             size_t(task.places[g][pair]) * kBlockFloats);
        }
        for (size_t i = 0; i < 6; ++i) task.gradient[i] += sums.gradient[6 * k + i];
    }
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace defrec::cpu {

HWY_EXPORT(SumGroups);
void sum_groups(const LmGroupTask& task, size_t first, size_t last) {
    HWY_DYNAMIC_DISPATCH(SumGroups)(task, first, last);
}

HWY_EXPORT(AddGroups);
void add_groups(const LmRowTask& task) { HWY_DYNAMIC_DISPATCH(AddGroups)(task); }

size_t lm_scratch_floats(const LmGroups& groups) {
    constexpr size_t kEquations = kJacobian * kJacobian + kJacobian;
    return padded(padded(kEquations) + groups.max_rows() * kRowFloats);
}

}  // namespace defrec::cpu
#endif
