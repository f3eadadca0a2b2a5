// The rows of stage rectify; see rectify_rows.hpp.
#include "backends/cpu/rectify_rows.hpp"

#include <algorithm>
#include <cstring>

#include "backends/shared/gray.hpp"
#include "include/defrec_c.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/rectify_rows.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <class V8>
HWY_INLINE V8 Bt601(V8 red, V8 green, V8 blue) {
    const hn::DFromV<V8> d8;
    const hn::Half<decltype(d8)> half8;
    const hn::RebindToSigned<hn::RepartitionToWide<decltype(d8)>> d16;
    const auto weigh = [&](auto r, auto g, auto b) HWY_ATTR {
        // Sums reach 65408: right as unsigned 16 bits.
        const auto sum = hn::Add(
            hn::Add(hn::Mul(hn::PromoteTo(d16, r), hn::Set(d16, kRedWeight)),
                    hn::Mul(hn::PromoteTo(d16, g), hn::Set(d16, kGreenWeight))),
            hn::Add(hn::Mul(hn::PromoteTo(d16, b), hn::Set(d16, kBlueWeight)), hn::Set(d16, 128)));
        const hn::RebindToUnsigned<decltype(d16)> du16;
        return hn::DemoteTo(half8, hn::BitCast(d16, hn::ShiftRight<8>(hn::BitCast(du16, sum))));
    };
    const auto low =
        weigh(hn::LowerHalf(half8, red), hn::LowerHalf(half8, green), hn::LowerHalf(half8, blue));
    const auto high =
        weigh(hn::UpperHalf(half8, red), hn::UpperHalf(half8, green), hn::UpperHalf(half8, blue));
    return hn::Combine(d8, high, low);
}

void GrayRow(uint32_t format, const uint8_t* src, uint8_t* dst, size_t n) {
    if (format == DEFREC_FORMAT_GRAY8) {
        std::memcpy(dst, src, n);
        return;
    }
    const hn::ScalableTag<uint8_t> d;
    const size_t step = hn::Lanes(d);
    const bool rgb = format == DEFREC_FORMAT_RGB8;
    const size_t pixel = format == DEFREC_FORMAT_BGRA8 ? 4 : 3;
    size_t x = 0;
    for (; x + step <= n; x += step) {
        auto c0 = hn::Zero(d), c1 = c0, c2 = c0, alpha = c0;
        if (pixel == 4)
            hn::LoadInterleaved4(d, src + 4 * x, c0, c1, c2, alpha);
        else
            hn::LoadInterleaved3(d, src + 3 * x, c0, c1, c2);
        hn::StoreU(rgb ? Bt601(c0, c1, c2) : Bt601(c2, c1, c0), d, dst + x);
    }
    for (; x < n; ++x) {
        const uint8_t* s = src + pixel * x;
        const int red = rgb ? s[0] : s[2], blue = rgb ? s[2] : s[0];
        dst[x] = uint8_t(gray_of(red, s[1], blue));
    }
}

// One vector of samples, as int32 lanes: the gray value, and all ones where the pixel is covered.
template <class D, class V>
HWY_INLINE V Sample(D d, const PaddedSource& source, V mx, V my, V& covered) {
    const auto& [gray, ignore, width, height] = source;
    const hn::RebindToUnsigned<D> du;
    const auto within = [d](V v, int32_t last) HWY_ATTR {
        return hn::And(hn::Gt(v, hn::Set(d, -1)), hn::Lt(v, hn::Set(d, last * 128 + 1)));
    };
    const auto inside = hn::And(within(mx, width - 1), within(my, height - 1));
    mx = hn::IfThenElseZero(inside, mx);
    my = hn::IfThenElseZero(inside, my);
    const auto seven = hn::Set(d, 127), one = hn::Set(d, 128), byte = hn::Set(d, 255);
    const auto wx = hn::And(mx, seven), wy = hn::And(my, seven);
    const auto column = hn::ShiftRight<7>(mx), row = hn::ShiftRight<7>(my);
    const auto pair = [&](const PaddedImage& image, int32_t next) HWY_ATTR {
        const auto offset = hn::Add(hn::Mul(row, hn::Set(d, image.stride)), column);
        return hn::GatherOffset(d, reinterpret_cast<const int32_t*>(image.pixels + next), offset);
    };
    const auto blend = [&](V taps) HWY_ATTR {
        const auto second = hn::BitCast(
            d, hn::And(hn::ShiftRight<8>(hn::BitCast(du, taps)), hn::BitCast(du, byte)));
        return hn::Add(hn::Mul(hn::And(taps, byte), hn::Sub(one, wx)), hn::Mul(second, wx));
    };
    const auto top = blend(pair(gray, 0)), bottom = blend(pair(gray, gray.stride));
    const auto sum = hn::Add(hn::Mul(top, hn::Sub(one, wy)), hn::Mul(bottom, wy));
    covered = hn::VecFromMask(d, inside);
    if (ignore.pixels != nullptr) {
        const auto taps =
            hn::And(hn::Or(pair(ignore, 0), pair(ignore, ignore.stride)), hn::Set(d, 0xffff));
        covered = hn::IfThenElseZero(hn::Eq(taps, hn::Zero(d)), covered);
    }
    return hn::IfThenElseZero(inside, hn::ShiftRight<14>(hn::Add(sum, hn::Set(d, 8192))));
}

void SampleRow(const PaddedSource& given, const int32_t* map, uint8_t* dst, uint8_t* mask,
               size_t n) {
    const PaddedSource source = given;  // no store of a pixel changes the copy
    const hn::ScalableTag<int32_t> d;
    const hn::Rebind<uint8_t, decltype(d)> d8;
    const size_t step = hn::Lanes(d);
    alignas(64) int32_t rest[2 * HWY_MAX_BYTES / sizeof(int32_t)];
    alignas(64) uint8_t rest_gray[HWY_MAX_BYTES], rest_mask[HWY_MAX_BYTES];
    for (size_t x = 0; x < n; x += step) {
        const bool whole = x + step <= n;
        const int32_t* from = map + 2 * x;
        if (!whole) {
            std::fill(rest, rest + 2 * step, -1);
            std::copy(from, map + 2 * n, rest);
            from = rest;
        }
        auto mx = hn::Zero(d), my = mx, covered = mx;
        hn::LoadInterleaved2(d, from, mx, my);
        const auto value = Sample(d, source, mx, my, covered);
        hn::StoreU(hn::DemoteTo(d8, value), d8, whole ? dst + x : rest_gray);
        hn::StoreU(hn::DemoteTo(d8, hn::And(covered, hn::Set(d, 255))), d8,
                   whole ? mask + x : rest_mask);
        if (!whole) {
            std::copy(rest_gray, rest_gray + (n - x), dst + x);
            std::copy(rest_mask, rest_mask + (n - x), mask + x);
        }
    }
}

uint8_t RowMaximum(const uint8_t* row, size_t n) {
    const hn::ScalableTag<uint8_t> d;
    const size_t step = hn::Lanes(d);
    auto maximum = hn::Zero(d);
    size_t x = 0;
    for (; x + step <= n; x += step) maximum = hn::Max(maximum, hn::LoadU(d, row + x));
    alignas(64) uint8_t lanes[HWY_MAX_BYTES];
    hn::Store(maximum, d, lanes);
    uint8_t result = *std::max_element(lanes, lanes + step);
    for (; x < n; ++x) result = std::max(result, row[x]);
    return result;
}

void ClearNearHighlights(const uint8_t* const* rows, size_t row_count, size_t n, int radius,
                         uint8_t threshold, uint8_t* scratch, uint8_t* mask) {
    const hn::ScalableTag<uint8_t> d;
    const size_t step = hn::Lanes(d), r = size_t(radius);
    std::memcpy(scratch + r, rows[0], n);
    std::fill(scratch, scratch + r, uint8_t{0});
    std::fill(scratch + r + n, scratch + 2 * r + n + step, uint8_t{0});
    for (size_t k = 1; k < row_count; ++k) {
        size_t x = 0;
        for (; x + step <= n; x += step)
            hn::StoreU(hn::Max(hn::LoadU(d, scratch + r + x), hn::LoadU(d, rows[k] + x)), d,
                       scratch + r + x);
        for (; x < n; ++x) scratch[r + x] = std::max(scratch[r + x], rows[k][x]);
    }
    const auto limit = hn::Set(d, threshold);
    const auto largest = [&](size_t x) HWY_ATTR {
        auto maximum = hn::LoadU(d, scratch + x);
        for (size_t k = 1; k <= 2 * r; ++k)
            maximum = hn::Max(maximum, hn::LoadU(d, scratch + x + k));
        return maximum;
    };
    size_t x = 0;
    for (; x + step <= n; x += step) {
        // max(m, limit) == m says m >= limit without an unsigned comparison.
        const auto m = largest(x);
        const auto bright = hn::VecFromMask(d, hn::Eq(hn::Max(m, limit), m));
        hn::StoreU(hn::AndNot(bright, hn::LoadU(d, mask + x)), d, mask + x);
    }
    alignas(64) uint8_t lanes[HWY_MAX_BYTES];
    if (x < n) hn::Store(largest(x), d, lanes);
    for (size_t k = 0; x < n; ++x, ++k)
        if (lanes[k] >= threshold) mask[x] = 0;
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace defrec::cpu {

HWY_EXPORT(GrayRow);
HWY_EXPORT(SampleRow);
HWY_EXPORT(RowMaximum);
HWY_EXPORT(ClearNearHighlights);

void gray_row(uint32_t format, const uint8_t* src, uint8_t* dst, size_t n) {
    HWY_DYNAMIC_DISPATCH(GrayRow)(format, src, dst, n);
}
void sample_row(const PaddedSource& source, const int32_t* map, uint8_t* dst, uint8_t* mask,
                size_t n) {
    HWY_DYNAMIC_DISPATCH(SampleRow)(source, map, dst, mask, n);
}
void ignore_row(const uint8_t* ignore, uint8_t* mask, size_t n) {
    for (size_t x = 0; x < n; ++x) mask[x] = ignore[x] != 0 ? 0 : 255;
}
uint8_t row_maximum(const uint8_t* row, size_t n) {
    return HWY_DYNAMIC_DISPATCH(RowMaximum)(row, n);
}
void clear_near_highlights(const uint8_t* const* rows, size_t row_count, size_t n, int radius,
                           uint8_t threshold, uint8_t* scratch, uint8_t* mask) {
    HWY_DYNAMIC_DISPATCH(ClearNearHighlights)(rows, row_count, n, radius, threshold, scratch, mask);
}

}  // namespace defrec::cpu
#endif
