// One hypothesis of 1-point RANSAC: lanes are matches, a pass over them reweights and accumulates
// the next correlation at once.
#include <limits>

#include "backends/cpu/ransac_kernels.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/ransac_follow.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;
namespace {

using D = hn::CappedTag<float, kRansacPadding>;
using V = hn::Vec<D>;

struct Vector3 {
    V x, y, z;
};

Vector3 relative_to(const float* const axis[3], size_t reference, size_t at) {
    const D d;
    return {hn::Sub(hn::Load(d, axis[0] + at), hn::Set(d, axis[0][reference])),
            hn::Sub(hn::Load(d, axis[1] + at), hn::Set(d, axis[1][reference])),
            hn::Sub(hn::Load(d, axis[2] + at), hn::Set(d, axis[2][reference]))};
}

// |to - R from|^2.
V squared_distance(const float r[9], const Vector3& from, const Vector3& to) {
    const D d;
    const auto rest = [&](int row, V value) HWY_ATTR {
        value = hn::NegMulAdd(hn::Set(d, r[3 * row]), from.x, value);
        value = hn::NegMulAdd(hn::Set(d, r[3 * row + 1]), from.y, value);
        return hn::NegMulAdd(hn::Set(d, r[3 * row + 2]), from.z, value);
    };
    const V x = rest(0, to.x), y = rest(1, to.y), z = rest(2, to.z);
    return hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z)));
}

// Sum of w^2 to from^T with w^2 = min(limit / d^2, 1).
void correlate(const RansacPairs& pairs, size_t reference, const float rotation[9], float limit,
               double m[9]) {
    const D d;
    V sum[9];
    for (V& s : sum) s = hn::Zero(d);
    for (size_t at = 0; at < pairs.padded; at += hn::Lanes(d)) {
        const Vector3 from = relative_to(pairs.from, reference, at),
                      to = relative_to(pairs.to, reference, at);
        const V bounded = hn::Max(squared_distance(rotation, from, to), hn::Set(d, 1e-20f));
        const V weight = hn::Mul(hn::Min(hn::Div(hn::Set(d, limit), bounded), hn::Set(d, 1.0f)),
                                 hn::Load(d, pairs.used + at));
        const V weighted[3] = {hn::Mul(weight, to.x), hn::Mul(weight, to.y), hn::Mul(weight, to.z)};
        for (int i = 0; i < 3; ++i) {
            sum[3 * i] = hn::MulAdd(weighted[i], from.x, sum[3 * i]);
            sum[3 * i + 1] = hn::MulAdd(weighted[i], from.y, sum[3 * i + 1]);
            sum[3 * i + 2] = hn::MulAdd(weighted[i], from.z, sum[3 * i + 2]);
        }
    }
    for (int i = 0; i < 9; ++i) m[i] = double(hn::GetLane(hn::SumOfLanes(d, sum[i])));
}

void follow(const RansacPairs& pairs, size_t reference, uint32_t iterations, float threshold,
            RansacHypothesis& out, float* squares) {
    const D d;
    const float limit = threshold * threshold;
    for (uint32_t i = 0; i < iterations; ++i) {
        static constexpr float kNone[9] = {};
        double m[9];
        // At first every weight is 1.
        correlate(pairs, reference, i == 0 ? kNone : out.rotation,
                  i == 0 ? std::numeric_limits<float>::max() : limit, m);
        nearest_rotation(m, out.rotation);
    }
    V support = hn::Zero(d);
    for (size_t at = 0; at < pairs.padded; at += hn::Lanes(d)) {
        const V square = squared_distance(out.rotation, relative_to(pairs.from, reference, at),
                                          relative_to(pairs.to, reference, at));
        hn::Store(square, d, squares + at);
        support = hn::Add(support, hn::IfThenElseZero(hn::Lt(square, hn::Set(d, limit)),
                                                      hn::Load(d, pairs.used + at)));
    }
    out.support = uint32_t(hn::GetLane(hn::SumOfLanes(d, support)));
}

}  // namespace
}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace defrec::cpu {

HWY_EXPORT(follow);
void ransac_follow(const RansacPairs& pairs, size_t reference, uint32_t iterations, float threshold,
                   RansacHypothesis& out, float* squares) {
    HWY_DYNAMIC_DISPATCH(follow)(pairs, reference, iterations, threshold, out, squares);
}

}  // namespace defrec::cpu
#endif
