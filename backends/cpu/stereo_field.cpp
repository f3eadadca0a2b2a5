// Fields of disparities in stereo: support, smoothing, filling, standing, upsampling.
#include <algorithm>

#include "backends/cpu/stereo_kernels.hpp"
#include "backends/stages/stereo.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/stereo_field.cpp"
#include <hwy/foreach_target.h>

#include "backends/cpu/stereo_lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {

using VI16 = hn::Vec<I16>;

void EndRow(int16_t* row, int width) { std::fill_n(row + width, kMargin, int16_t(kNoDisparity)); }

// Which disparities are at most range apart, by their saturated difference: a missing one is far
// from all. The differences are shifted so that those within the range are the least ones.
class Agreement {
  public:
    explicit Agreement(int range)
        : shift_(hn::Set(I16(), int16_t(range - 32768))),
          limit_(hn::Set(I16(), int16_t(2 * range + 1 - 32768))) {}
    HWY_INLINE hn::Mask<I16> operator()(VI16 difference) const {
        return hn::Lt(hn::Add(difference, shift_), limit_);
    }

  private:
    VI16 shift_, limit_;
};

void SupportedRow(Plane<const int16_t> field, int width, int height, int y,
                  const StereoConstants& c, int16_t* dst) {
    const I16 d;
    const VI16 none = hn::Set(d, kNoDisparity);
    const Agreement agrees(kSupportRange);
    for (int x = 0; x < width; x += int(hn::Lanes(d))) {
        const VI16 centre = hn::LoadU(d, field.row(y) + x);
        VI16 agreeing = hn::Zero(d);
        for (int v = y - 4; v <= y + 4; v += 2) {
            if (v < 0 || v >= height) continue;
            for (int u = -4; u <= 4; u += 2) {
                const VI16 other = hn::LoadU(d, field.row(v) + x + u);
                agreeing =
                    hn::Sub(agreeing, hn::VecFromMask(d, agrees(hn::SaturatedSub(other, centre))));
            }
        }
        const auto kept = hn::Gt(agreeing, hn::Set(d, int16_t(c.support - 1)));
        hn::StoreU(hn::IfThenElse(kept, centre, none), d, dst + x);
    }
    EndRow(dst, width);
}

// Mean of the neighbours that agree with the centre; neighbour(k) loads the k-th.
template <class Neighbour>
HWY_INLINE VI16 Smoothed(VI16 centre, int radius, const Agreement& agreement,
                         Neighbour&& neighbour) {
    const I16 d;
    VI16 sum = hn::Zero(d), count = hn::Set(d, 1);
    for (int k = -radius; k <= radius; ++k) {
        if (k == 0) continue;
        const VI16 difference = hn::SaturatedSub(neighbour(k), centre);
        const auto agrees = agreement(difference);
        sum = hn::Add(sum, hn::IfThenElseZero(agrees, difference));
        count = hn::Sub(count, hn::VecFromMask(d, agrees));
    }
    // The reciprocal of count, looked up by its two bytes.
    alignas(16) static constexpr int16_t kTable[8] = {0,    32767, 16384, 10923,
                                                      8192, 6554,  5461,  4681};
    const VI16 bytes = hn::Add(hn::Mul(count, hn::Set(d, 0x0202)), hn::Set(d, 0x0100));
    const VI16 table = hn::LoadDup128(d, kTable);
    const VI16 reciprocal = hn::TableLookupBytes(table, bytes);
    const VI16 mean = hn::Add(centre, hn::MulFixedPoint15(sum, reciprocal));
    return hn::IfThenElse(hn::Eq(centre, hn::Set(d, kNoDisparity)), centre, mean);
}

void SmoothAlongRow(const int16_t* src, int width, int radius, int range, int16_t* dst) {
    const I16 d;
    const Agreement agreement(range);
    for (int x = 0; x < width; x += int(hn::Lanes(d)))
        hn::StoreU(Smoothed(hn::LoadU(d, src + x), radius, agreement,
                            [&](int k) HWY_ATTR { return hn::LoadU(d, src + x + k); }),
                   d, dst + x);
    EndRow(dst, width);
}

// rows: those of the columns' window.
void SmoothAlongColumns(const int16_t* const* rows, int width, int radius, int range,
                        int16_t* dst) {
    const I16 d;
    const Agreement agreement(range);
    for (int x = 0; x < width; x += int(hn::Lanes(d)))
        hn::StoreU(Smoothed(hn::LoadU(d, rows[radius] + x), radius, agreement,
                            [&](int k) HWY_ATTR { return hn::LoadU(d, rows[k + radius] + x); }),
                   d, dst + x);
    EndRow(dst, width);
}

void SmoothRows(const SmoothJob& job, int y0, int y1, int16_t* scratch) {
    const ptrdiff_t stride = ptrdiff_t(smooth_scratch_row(job.width));
    // Of each pass the rows of a window, smoothed along, and the row that it gave last.
    const auto along = [&](int pass, int y) {
        return scratch + (pass * (kSmoothRing + 1) + y % kSmoothRing) * stride;
    };
    const auto result = [&](int pass) {
        return scratch + (pass * (kSmoothRing + 1) + kSmoothRing) * stride + kMargin;
    };
    for (int pass = 0; pass < job.passes; ++pass)
        std::fill_n(result(pass) - kMargin, kMargin, int16_t(kNoDisparity));
    const int reach = job.passes * job.radius;
    for (int y = std::max(0, y0 - reach); y < y1 + reach; ++y) {
        const int16_t* row = y < job.height ? job.from.row(y) : nullptr;
        for (int pass = 0; pass < job.passes; ++pass) {
            // The row that comes in is that many behind row y, and what comes out is for the next.
            const int in = y - pass * job.radius, out = in - job.radius,
                      rest = (job.passes - 1 - pass) * job.radius;
            if (row != nullptr)
                SmoothAlongRow(row, job.width, job.radius, job.range, along(pass, in));
            row = nullptr;
            if (out < std::max(0, y0 - rest) || out >= std::min(job.height, y1 + rest)) continue;
            const int16_t* rows[2 * kMaxSmoothRadius + 1];
            for (int k = -job.radius; k <= job.radius; ++k)
                rows[k + job.radius] =
                    out + k >= 0 && out + k < job.height ? along(pass, out + k) : job.none_row;
            SmoothAlongColumns(rows, job.width, job.radius, job.range, result(pass));
            row = result(pass);
        }
        if (row != nullptr) std::copy_n(row, job.width + job.margin, job.to.row(y - reach));
    }
}

void CoarserRow(const int16_t* HWY_RESTRICT upper, const int16_t* HWY_RESTRICT lower, int width,
                int16_t* HWY_RESTRICT dst) {
    // The margins hold no disparities, so an odd last column needs no care.
    for (int x = 0; x < (width + 1) / 2; ++x) {
        const int values[4] = {upper[2 * x], upper[2 * x + 1], lower[2 * x], lower[2 * x + 1]};
        int sum = 0, count = 0;
        for (const int value : values) {
            sum += value != kNoDisparity ? value : 0;
            count += value != kNoDisparity;
        }
        // floor((2 sum + count) / (2 count)); the factor is a sixth in 18 bits, exact for the sums
        // that occur.
        const int third = int((uint32_t(2 * sum + 3) * 43691u) >> 18), half = (sum + 1) >> 1,
                  quarter = (sum + 2) >> 2;
        const int mean = count == 4 ? quarter : count == 3 ? third : count == 2 ? half : sum;
        dst[x] = int16_t(count == 0 ? kNoDisparity : mean);
    }
    EndRow(dst, (width + 1) / 2);
}

void FillRow(int16_t* row, int width, const int16_t* coarse, const int16_t* coarse2,
             int coarse_width) {
    for (int x = 0; x < width; ++x) {
        if (row[x] != kNoDisparity) continue;
        const int u = x / 2, u2 = std::clamp(x % 2 == 0 ? u - 1 : u + 1, 0, coarse_width - 1);
        row[x] = int16_t((9 * coarse[u] + 3 * coarse[u2] + 3 * coarse2[u] + coarse2[u2] + 8) >> 4);
    }
}

void StandingRow(Plane<const int16_t> supported, Plane<const int16_t> dense, int width, int height,
                 int y, const StereoConstants& c, int16_t* extent, uint8_t* dst) {
    const I16 d;
    const hn::Rebind<uint8_t, I16> d8;
    int16_t* minimum = extent + kMargin;
    int16_t* maximum = minimum + width + 2 * kMargin;
    const int lanes = int(hn::Lanes(d));
    const int first = std::max(0, y - kEdgeRadius), last = std::min(height - 1, y + kEdgeRadius);
    for (int x = 0; x < width; x += lanes) {
        VI16 low = hn::LoadU(d, dense.row(first) + x), high = low;
        for (int v = first + 1; v <= last; ++v) {
            low = hn::Min(low, hn::LoadU(d, dense.row(v) + x));
            high = hn::Max(high, hn::LoadU(d, dense.row(v) + x));
        }
        hn::StoreU(low, d, minimum + x);
        hn::StoreU(high, d, maximum + x);
    }
    std::fill_n(minimum - kMargin, kMargin, minimum[0]);
    std::fill_n(maximum - kMargin, kMargin, maximum[0]);
    std::fill_n(minimum + width, kMargin, minimum[width - 1]);
    std::fill_n(maximum + width, kMargin, maximum[width - 1]);
    for (int x = 0; x < width; x += lanes) {
        VI16 low = hn::LoadU(d, minimum + x), high = hn::LoadU(d, maximum + x);
        for (int k = 1; k <= kEdgeRadius; ++k) {
            low =
                hn::Min(low, hn::Min(hn::LoadU(d, minimum + x - k), hn::LoadU(d, minimum + x + k)));
            high = hn::Max(high,
                           hn::Max(hn::LoadU(d, maximum + x - k), hn::LoadU(d, maximum + x + k)));
        }
        const VI16 limit = hn::Set(d, int16_t(c.edge));
        const auto doubtful = hn::Gt(hn::Sub(hn::LoadU(d, dense.row(y) + x), low), limit);
        const auto unknown = hn::Eq(hn::LoadU(d, supported.row(y) + x), hn::Set(d, kNoDisparity));
        const auto open = hn::Or(hn::Gt(hn::Sub(high, low), limit), unknown);
        const VI16 stands = hn::IfThenElse(open, hn::Set(d, kOpen), hn::Set(d, kSettled));
        hn::StoreU(hn::DemoteTo(d8, hn::IfThenZeroElse(doubtful, stands)), d8, dst + x);
    }
    dst[width] = dst[width - 1];
}

// A row with its end values repeated on both sides.
void CopyPadded(const int16_t* row, int width, int16_t* dst) {
    std::copy_n(row, width, dst);
    std::fill_n(dst - kMargin, kMargin, row[0]);
    std::fill_n(dst + width, kMargin, row[width - 1]);
}

void UpsampleRow(Plane<const int16_t> half, int half_width, int half_height, int width, int y,
                 int16_t* dst) {
    const I16 d;
    const int v = std::min(y / 2, half_height - 1);
    const int v2 = std::clamp(y % 2 == 0 ? y / 2 - 1 : y / 2 + 1, 0, half_height - 1);
    int16_t near_memory[DEFREC_MAX_SIDE / 2 + 2 * kMargin],
        far_memory[DEFREC_MAX_SIDE / 2 + 2 * kMargin];
    int16_t *near = near_memory + kMargin, *far = far_memory + kMargin;
    CopyPadded(half.row(v), half_width, near);
    CopyPadded(half.row(v2), half_width, far);
    const VI16 three = hn::Set(d, 3), four = hn::Set(d, 4), range = hn::Set(d, kUpsampleRange);
    const auto blend = [&](VI16 a, VI16 b, VI16 c, VI16 e) HWY_ATTR {
        const VI16 spread =
            hn::Sub(hn::Max(hn::Max(a, b), hn::Max(c, e)), hn::Min(hn::Min(a, b), hn::Min(c, e)));
        // (9 a + 3 b + 3 c + e + 4) >> 3 by differences, which are small wherever it is used.
        const VI16 sides = hn::Mul(three, hn::Add(hn::Sub(b, a), hn::Sub(c, a)));
        const VI16 change = hn::ShiftRight<3>(hn::Add(hn::Add(sides, hn::Sub(e, a)), four));
        return hn::Add(hn::Add(a, a), hn::IfThenZeroElse(hn::Gt(spread, range), change));
    };
    for (int u = 0; 2 * u < width; u += int(hn::Lanes(d))) {
        const VI16 a = hn::LoadU(d, near + u), c = hn::LoadU(d, far + u);
        const VI16 even = blend(a, hn::LoadU(d, near + u - 1), c, hn::LoadU(d, far + u - 1));
        const VI16 odd = blend(a, hn::LoadU(d, near + u + 1), c, hn::LoadU(d, far + u + 1));
        hn::StoreInterleaved2(even, odd, d, dst + 2 * u);
    }
    EndRow(dst, width);
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace defrec::cpu {

HWY_EXPORT(SupportedRow);
HWY_EXPORT(SmoothRows);
HWY_EXPORT(CoarserRow);
HWY_EXPORT(FillRow);
HWY_EXPORT(StandingRow);
HWY_EXPORT(UpsampleRow);

void supported_row(Plane<const int16_t> field, int width, int height, int y,
                   const StereoConstants& c, int16_t* dst) {
    HWY_DYNAMIC_DISPATCH(SupportedRow)(field, width, height, y, c, dst);
}
void smooth_rows(const SmoothJob& job, int y0, int y1, int16_t* scratch) {
    HWY_DYNAMIC_DISPATCH(SmoothRows)(job, y0, y1, scratch);
}
void coarser_row(const int16_t* upper, const int16_t* lower, int width, int16_t* dst) {
    HWY_DYNAMIC_DISPATCH(CoarserRow)(upper, lower, width, dst);
}
void fill_row(int16_t* row, int width, const int16_t* coarse, const int16_t* coarse2,
              int coarse_width) {
    HWY_DYNAMIC_DISPATCH(FillRow)(row, width, coarse, coarse2, coarse_width);
}
void standing_row(Plane<const int16_t> supported, Plane<const int16_t> dense, int width, int height,
                  int y, const StereoConstants& c, int16_t* extent, uint8_t* dst) {
    HWY_DYNAMIC_DISPATCH(StandingRow)(supported, dense, width, height, y, c, extent, dst);
}
void upsample_row(Plane<const int16_t> half, int half_width, int half_height, int width, int y,
                  int16_t* dst) {
    HWY_DYNAMIC_DISPATCH(UpsampleRow)(half, half_width, half_height, width, y, dst);
}

}  // namespace defrec::cpu
#endif
