// Points of a surface in SIMD lanes: their deformation, and the live depth under them. The formulas
// of backends/shared/motion.hpp and live_depth.hpp. Included once per target by files that use
// Highway's foreach_target.
#include <hwy/highway.h>

#include "backends/cpu/blend_clusters.hpp"
#include "backends/shared/live_depth.hpp"

#if defined(DEFREC_CPU_SURFACE_LANES) == defined(HWY_TARGET_TOGGLE)
#ifdef DEFREC_CPU_SURFACE_LANES
#undef DEFREC_CPU_SURFACE_LANES
#else
#define DEFREC_CPU_SURFACE_LANES
#endif

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <class V>
struct Lanes3 {
    V x, y, z;
};
template <class V>
HWY_INLINE V dot(const Lanes3<V>& a, const Lanes3<V>& b) {
    return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}
template <class V>
HWY_INLINE Lanes3<V> cross(const Lanes3<V>& a, const Lanes3<V>& b) {
    return {hn::MulSub(a.y, b.z, hn::Mul(a.z, b.y)), hn::MulSub(a.z, b.x, hn::Mul(a.x, b.z)),
            hn::MulSub(a.x, b.y, hn::Mul(a.y, b.x))};
}
template <class V>
HWY_INLINE Lanes3<V> scale(V s, const Lanes3<V>& a) {
    return {hn::Mul(s, a.x), hn::Mul(s, a.y), hn::Mul(s, a.z)};
}
template <class V>
HWY_INLINE Lanes3<V> add(const Lanes3<V>& a, const Lanes3<V>& b) {
    return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}
template <class V>
HWY_INLINE Lanes3<V> subtract(const Lanes3<V>& a, const Lanes3<V>& b) {
    return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}

template <class D>
HWY_INLINE Lanes3<hn::Vec<D>> load_lanes(D d, const float* x, const float* y, const float* z) {
    return {hn::Load(d, x), hn::Load(d, y), hn::Load(d, z)};
}

// v + 2 axis x (axis x v + w v)
template <class V>
HWY_INLINE Lanes3<V> rotate(V w, const Lanes3<V>& axis, const Lanes3<V>& v) {
    Lanes3<V> inner = cross(axis, v);
    inner = {hn::MulAdd(w, v.x, inner.x), hn::MulAdd(w, v.y, inner.y), hn::MulAdd(w, v.z, inner.z)};
    const Lanes3<V> turned = cross(axis, inner);
    return {hn::Add(v.x, hn::Add(turned.x, turned.x)), hn::Add(v.y, hn::Add(turned.y, turned.y)),
            hn::Add(v.z, hn::Add(turned.z, turned.z))};
}

// A blended motion: unit rotation (w, axis) and translation.
template <class V>
struct MotionLanes {
    V w;
    Lanes3<V> axis, translation;

    HWY_INLINE Lanes3<V> direction(const Lanes3<V>& v) const { return rotate(w, axis, v); }
    HWY_INLINE Lanes3<V> point(const Lanes3<V>& p) const {
        return add(rotate(w, axis, p), translation);
    }
};

template <class D, class V = hn::Vec<D>>
HWY_INLINE MotionLanes<V> blend_lanes(D d, const GroupMotion& group, const V weight[kBlendNodes]) {
    V sum[8];
    for (size_t i = 0; i < 8; ++i)
        sum[i] = hn::Mul(weight[0], hn::Set(d, group.dual_quaternion[0][i]));
    for (size_t k = 1; k < kBlendNodes; ++k)
        for (size_t i = 0; i < 8; ++i)
            sum[i] = hn::MulAdd(weight[k], hn::Set(d, group.dual_quaternion[k][i]), sum[i]);
    const V squared =
        hn::MulAdd(sum[0], sum[0],
                   hn::MulAdd(sum[1], sum[1], hn::MulAdd(sum[2], sum[2], hn::Mul(sum[3], sum[3]))));
    const auto usable = hn::Gt(squared, hn::Set(d, float(kMinBlendLength * kMinBlendLength)));
    const V inverse =
        hn::Div(hn::Set(d, 1.0f), hn::Sqrt(hn::IfThenElse(usable, squared, hn::Set(d, 1.0f))));
    for (size_t i = 0; i < 8; ++i)
        sum[i] = hn::IfThenElse(usable, hn::Mul(sum[i], inverse),
                                hn::Set(d, group.dual_quaternion[group.first][i]));
    // t = 2 dual real*
    const Lanes3<V> axis{sum[1], sum[2], sum[3]}, dual{sum[5], sum[6], sum[7]};
    const Lanes3<V> turn = cross(axis, dual);
    const V two = hn::Set(d, 2.0f);
    const auto component = [&](V dual_part, V axis_part, V turn_part) HWY_ATTR {
        return hn::Mul(
            two, hn::Add(hn::NegMulAdd(sum[4], axis_part, hn::Mul(sum[0], dual_part)), turn_part));
    };
    return {sum[0],
            axis,
            {component(dual.x, axis.x, turn.x), component(dual.y, axis.y, turn.y),
             component(dual.z, axis.z, turn.z)}};
}

// The same where rotations are far apart: each lane by its own first control point. first: which of
// the group's that is.
template <class D, class V = hn::Vec<D>>
HWY_NOINLINE MotionLanes<V> blend_lanes_apart(D d, const NodeMotion* motions,
                                              const std::array<int32_t, kBlendNodes>& node,
                                              const V weight[kBlendNodes], const float* first) {
    MotionLanes<V> all = blend_lanes(d, GroupMotion(motions, node), weight);
    for (size_t k = 1; k < kBlendNodes; ++k) {
        const auto here = hn::Eq(hn::Load(d, first), hn::Set(d, float(k)));
        const MotionLanes<V> own = blend_lanes(d, GroupMotion(motions, node, k), weight);
        const auto take = [&](V& to, V from) HWY_ATTR { to = hn::IfThenElse(here, from, to); };
        take(all.w, own.w);
        take(all.axis.x, own.axis.x);
        take(all.axis.y, own.axis.y);
        take(all.axis.z, own.axis.z);
        take(all.translation.x, own.translation.x);
        take(all.translation.y, own.translation.y);
        take(all.translation.z, own.translation.z);
    }
    return all;
}

// What the disparity image says under points: whether they fall inside, whether there is depth, and
// how deep (mm, where there is); and where in the image that is, bytes.
template <class D, class V = hn::Vec<D>>
struct DepthLanes {
    hn::Mask<D> inside, known;
    V depth, inverse_z;
    hn::Vec<hn::Rebind<int32_t, D>> offset;
};
template <class D, class V = hn::Vec<D>>
HWY_INLINE DepthLanes<D> depth_lanes(D d, const defrec_camera& camera, const DisparityImage& image,
                                     const Lanes3<V>& p) {
    const hn::Rebind<int32_t, D> di;
    const V zero = hn::Zero(d);
    const auto in_front = hn::Gt(p.z, hn::Set(d, float(kMinDepthMm)));
    const V inverse_z = hn::Div(hn::Set(d, 1.0f), hn::IfThenElse(in_front, p.z, hn::Set(d, 1.0f)));
    V u = hn::MulAdd(hn::Set(d, float(camera.fx)), hn::Mul(p.x, inverse_z),
                     hn::Set(d, float(camera.cx)));
    V v = hn::MulAdd(hn::Set(d, float(camera.fy)), hn::Mul(p.y, inverse_z),
                     hn::Set(d, float(camera.cy)));
    const auto across = hn::And(hn::Ge(u, zero), hn::Le(u, hn::Set(d, float(image.width - 1))));
    const auto down = hn::And(hn::Ge(v, zero), hn::Le(v, hn::Set(d, float(image.height - 1))));
    const auto inside = hn::And(in_front, hn::And(across, down));
    if (image.data == nullptr) return {inside, hn::Lt(zero, zero), zero, inverse_z, hn::Zero(di)};
    u = hn::IfThenElseZero(inside, u);
    v = hn::IfThenElseZero(inside, v);
    const auto x = hn::Min(hn::ConvertTo(di, u), hn::Set(di, int32_t(image.width) - 2));
    const auto y = hn::Min(hn::ConvertTo(di, v), hn::Set(di, int32_t(image.height) - 2));
    const V right = hn::Sub(u, hn::ConvertTo(d, x)), below = hn::Sub(v, hn::ConvertTo(d, y));

    // One 32-bit load takes a pixel and its right neighbour.
    const auto offset =
        hn::ShiftLeft<1>(hn::Add(hn::Mul(y, hn::Set(di, int32_t(image.stride))), x));
    const auto* base = reinterpret_cast<const int32_t*>(image.data);
    const auto top = hn::GatherOffset(di, base, offset);
    const auto bottom =
        hn::GatherOffset(di, base, hn::Add(offset, hn::Set(di, int32_t(image.stride) * 2)));
    const auto d00 = hn::ShiftRight<16>(hn::ShiftLeft<16>(top)), d01 = hn::ShiftRight<16>(top);
    const auto d10 = hn::ShiftRight<16>(hn::ShiftLeft<16>(bottom)),
               d11 = hn::ShiftRight<16>(bottom);
    const auto minimum = hn::Min(hn::Min(d00, d01), hn::Min(d10, d11)),
               maximum = hn::Max(hn::Max(d00, d01), hn::Max(d10, d11));
    const auto smooth =
        hn::And(hn::Gt(minimum, hn::Zero(di)),
                hn::Lt(hn::Sub(maximum, minimum), hn::Set(di, kLargestDepthStep + 1)));

    const V above = hn::MulAdd(right, hn::ConvertTo(d, hn::Sub(d01, d00)), hn::ConvertTo(d, d00));
    const V under = hn::MulAdd(right, hn::ConvertTo(d, hn::Sub(d11, d10)), hn::ConvertTo(d, d10));
    const V between = hn::MulAdd(below, hn::Sub(under, above), above);
    const V half = hn::Set(d, 0.5f);
    const auto to_right = hn::RebindMask(di, hn::Ge(right, half)),
               to_below = hn::RebindMask(di, hn::Ge(below, half));
    const auto nearest = hn::IfThenElse(to_below, hn::IfThenElse(to_right, d11, d10),
                                        hn::IfThenElse(to_right, d01, d00));
    const V disparity =
        hn::IfThenElse(hn::RebindMask(d, smooth), between, hn::ConvertTo(d, nearest));
    const V whole =
        hn::Add(disparity, hn::Set(d, float(kDisparityOne * camera.disparity_offset_px)));
    const auto known = hn::And(inside, hn::And(hn::Gt(disparity, zero), hn::Gt(whole, zero)));
    const V product = hn::Set(d, float(double(kDisparityOne) * camera.fx * camera.baseline_mm));
    return {
        inside, known,
        hn::IfThenElseZero(known, hn::Div(product, hn::IfThenElse(known, whole, hn::Set(d, 1.0f)))),
        inverse_z, offset};
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
