// Stage warp, group by group in SIMD lanes.
#include "backends/cpu/warp_groups.hpp"

#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/warp_groups.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/highway.h>

#include "backends/cpu/surface_lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {

using D = hn::CappedTag<float, kLanes>;
using V = hn::Vec<D>;

// What the frame says of each point, as stage warp numbers it, and the live depth minus the
// point's.
HWY_INLINE hn::Vec<hn::Rebind<uint32_t, D>> observe(const WarpTask& task, const Lanes3<V>& p,
                                                    const Lanes3<V>& n, V& residual) {
    const D d;
    const hn::Rebind<uint32_t, D> du;
    const auto live = depth_lanes(d, task.camera, task.image, p);
    residual = hn::IfThenElseZero(live.known, hn::Sub(live.depth, p.z));
    const auto facing = hn::Lt(dot(n, p), hn::Zero(d));
    const auto close = hn::And(facing, hn::Le(hn::Abs(residual), hn::Set(d, task.tolerance_mm)));
    const auto in_front = hn::And(facing, hn::Lt(residual, hn::Zero(d)));
    const auto code = [&](uint32_t value) HWY_ATTR { return hn::Set(du, value); };
    auto result = hn::IfThenElse(hn::RebindMask(du, in_front), code(DEFREC_OCCLUDED),
                                 code(DEFREC_INCONSISTENT));
    result = hn::IfThenElse(hn::RebindMask(du, close), code(DEFREC_OBSERVED), result);
    result = hn::IfThenElse(hn::RebindMask(du, live.known), result, code(DEFREC_NO_DEPTH));
    return hn::IfThenElse(hn::RebindMask(du, live.inside), result, code(DEFREC_OUTSIDE));
}

void WarpGroups(const WarpTask& task, size_t first, size_t last) {
    const D d;
    const size_t lanes = hn::Lanes(d);
    const WarpPoints& points = *task.points;
    HWY_ALIGN float front[4 * kLanes],
        back[4 * kLanes];  // position and normal x; normal y z, residual, observation
    for (size_t g = first; g < last; ++g) {
        const WarpGroup& group = points.groups[g];
        const GroupMotion motions(task.motions, group.node);
        for (size_t at = group.first; at < group.first + group.count; at += lanes) {
            const auto load = [&](size_t c)
                                  HWY_ATTR { return hn::Load(d, points.component(c) + at); };
            const V weight[kBlendNodes] = {load(6), load(7), load(8), load(9)};
            const auto motion = HWY_LIKELY(motions.together)
                                    ? blend_lanes(d, motions, weight)
                                    : blend_lanes_apart(d, task.motions, group.node, weight,
                                                        points.component(WarpPoints::kFirst) + at);
            const Lanes3<V> p = motion.point(Lanes3<V>{load(0), load(1), load(2)});
            const Lanes3<V> n = motion.direction(Lanes3<V>{load(3), load(4), load(5)});
            V residual;
            const auto observation = observe(task, p, n, residual);
            hn::StoreInterleaved4(p.x, p.y, p.z, n.x, d, front);
            hn::StoreInterleaved4(n.y, n.z, residual, hn::BitCast(d, observation), d, back);
            const size_t count = std::min(lanes, size_t(group.first + group.count - at));
            for (size_t i = 0; i < count; ++i) {
                char* sample = reinterpret_cast<char*>(&task.samples[points.source[at + i]]);
                std::memcpy(sample, front + 4 * i, 4 * sizeof(float));
                std::memcpy(sample + 4 * sizeof(float), back + 4 * i, 4 * sizeof(float));
            }
        }
    }
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace defrec::cpu {

HWY_EXPORT(WarpGroups);
void warp_groups(const WarpTask& task, size_t first, size_t last) {
    HWY_DYNAMIC_DISPATCH(WarpGroups)(task, first, last);
}

void WarpPoints::build(const defrec_surface_point* points, size_t count) {
    std::vector<BlendKey> keys;
    for (size_t i = 0; i < count; ++i)
        keys.push_back({BlendWeights(points[i]).node, 0, uint32_t(i)});
    std::sort(keys.begin(), keys.end());

    groups.clear();
    source.clear();
    for (size_t i = 0; i < keys.size(); ++i) {
        if (i == 0 || keys[i].node != keys[i - 1].node) {
            source.resize(padded(source.size()), i == 0 ? 0 : source.back());
            groups.push_back({keys[i].node, uint32_t(source.size()), 0});
        }
        source.push_back(keys[i].index);
        ++groups.back().count;
    }
    if (count > 0) source.resize(padded(source.size()), source.back());

    stride = source.size();
    values.assign(kComponents * stride, 0.0f);
    for (size_t i = 0; i < stride; ++i) {
        const defrec_surface_point& point = points[source[i]];
        const BlendWeights blend_weights(point);
        for (size_t c = 0; c < 3; ++c) {
            values[c * stride + i] = point.position[c];
            values[(3 + c) * stride + i] = point.normal[c];
        }
        for (size_t k = 0; k < kBlendNodes; ++k)
            values[(6 + k) * stride + i] = blend_weights.weight[k];
        values[kFirst * stride + i] = float(blend_weights.first);
    }
}

}  // namespace defrec::cpu
#endif
