// Fields of disparities in stereo: support, smoothing, filling, standing, what lies between
// samples.
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
        for (int v = y - kSupportRadius; v <= y + kSupportRadius; ++v) {
            if (v < 0 || v >= height) continue;
            for (int u = -kSupportRadius; u <= kSupportRadius; ++u) {
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
    alignas(16) static constexpr int16_t kTable[8] = {kReciprocal[0], kReciprocal[1],
                                                      kReciprocal[2], kReciprocal[3],
                                                      kReciprocal[4], kReciprocal[5]};
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
    // The scratch of each pass holds the rows of a window, smoothed along, and the row that it gave
    // last.
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
        if (row != nullptr) std::copy_n(row, job.width + kMargin, job.to.row(y - reach));
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

void StandingRow(Plane<const int16_t> supported, Plane<const int16_t> dense, int y,
                 const StereoConstants& c, int16_t* extent, uint8_t* dst) {
    const int width = c.half_samples_x, height = c.half_samples_y;
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
struct PaddedRow {
    PaddedRow(const int16_t* row, int width) {
        std::copy_n(row, width, values);
        std::fill_n(memory, kMargin, row[0]);
        std::fill_n(values + width, kMargin, row[width - 1]);
    }
    int16_t memory[DEFREC_MAX_SIDE / 4 + 2 * kMargin];
    int16_t* values = memory + kMargin;
};

void BetweenRow(Plane<const int16_t> samples, int samples_x, int samples_y, int width, int y,
                int16_t* dst) {
    const I16 d;
    const PaddedRow upper(samples.row(y / 2), samples_x),
        lower(samples.row(std::min((y + 1) / 2, samples_y - 1)), samples_x);
    const auto at = [&](int i) HWY_ATTR {
        return hn::Add(hn::LoadU(d, upper.values + i), hn::LoadU(d, lower.values + i));
    };
    const VI16 one = hn::Set(d, 1), two = hn::Set(d, 2);
    const hn::RebindToUnsigned<I16> unsigned16;  // sums of four disparities fit only these
    for (int i = 0; 2 * i < width; i += int(hn::Lanes(d))) {
        const VI16 here = at(i), both = hn::Add(here, at(i + 1));
        const auto sum = hn::BitCast(unsigned16, hn::Add(both, two));
        hn::StoreInterleaved2(hn::ShiftRight<1>(hn::Add(here, one)),
                              hn::BitCast(d, hn::ShiftRight<2>(sum)), d, dst + 2 * i);
    }
    EndRow(dst, width);
}

void HypothesisRow(Plane<const int16_t> samples, int samples_x, int samples_y, int width, int y,
                   int16_t* dst) {
    const hn::CappedTag<int16_t, 16> d;  // four vectors reach no farther than the margin
    using V = hn::Vec<decltype(d)>;
    const int v = y / 4, q = kSampleWeight[y % 4];
    const PaddedRow near(samples.row(std::min(v, samples_y - 1)), samples_x),
        far(samples.row(std::clamp(y % 4 == 0 ? v - 1 : v + 1, 0, samples_y - 1)), samples_x);
    const bool nearest_is_far = q < 4;
    const V near_weight = hn::Set(d, int16_t(q)), far_weight = hn::Set(d, int16_t(8 - q)),
            range = hn::Set(d, kUpsampleRange), half = hn::Set(d, 16);
    for (int i = 0; 4 * i < width; i += int(hn::Lanes(d))) {
        const V a = hn::LoadU(d, near.values + i), c = hn::LoadU(d, far.values + i),
                down = hn::Mul(far_weight, hn::Sub(c, a)), twice = hn::Add(a, a);
        const auto blend = [&](int side, int weight) HWY_ATTR {
            const V b = hn::LoadU(d, near.values + i + side),
                    e = hn::LoadU(d, far.values + i + side),
                    spread = hn::Sub(hn::Max(hn::Max(a, b), hn::Max(c, e)),
                                     hn::Min(hn::Min(a, b), hn::Min(c, e))),
                    across = hn::Add(hn::Mul(near_weight, hn::Sub(b, a)),
                                     hn::Mul(far_weight, hn::Sub(e, a)));
            const V change = hn::Add(hn::Mul(hn::Set(d, int16_t(weight)), down),
                                     hn::Mul(hn::Set(d, int16_t(8 - weight)), across));
            const V nearest = weight < 4 ? (nearest_is_far ? e : b) : (nearest_is_far ? c : a);
            return hn::IfThenElse(hn::Gt(spread, range), hn::Add(nearest, nearest),
                                  hn::Add(twice, hn::ShiftRight<5>(hn::Add(change, half))));
        };
        hn::StoreInterleaved4(blend(-1, kSampleWeight[0]), blend(1, kSampleWeight[1]),
                              blend(1, kSampleWeight[2]), blend(1, kSampleWeight[3]), d,
                              dst + 4 * i);
    }
}

// Beyond the row's end there are no disparities, which gives what the clamped ones would.
void ResultRow(Plane<const int16_t> samples, int samples_y, int width, int range, int y,
               int16_t* dst) {
    const I16 d;
    const int16_t* near = samples.row(y / 2);
    const int16_t* far = samples.row(std::min((y + 1) / 2, samples_y - 1));
    const Agreement agreement(range);
    const VI16 none = hn::Set(d, kNoDisparity), zero = hn::Zero(d), one = hn::Set(d, 1),
               two = hn::Set(d, 2), three = hn::Set(d, 3);
    const int lanes = int(hn::Lanes(d));
    alignas(64) int16_t end[2 * HWY_MAX_BYTES / sizeof(int16_t)];
    for (int i = 0; 2 * i < width; i += lanes) {
        const VI16 a = hn::LoadU(d, near + i);
        VI16 count = one, sum = zero;
        const auto take = [&](const int16_t* row) HWY_ATTR {
            const VI16 difference = hn::SaturatedSub(hn::LoadU(d, row), a);
            const auto agrees = agreement(difference);
            count = hn::Sub(count, hn::VecFromMask(d, agrees));
            sum = hn::Add(sum, hn::IfThenElseZero(agrees, difference));
        };
        take(far + i);
        const VI16 below = sum;
        take(near + i + 1);
        take(far + i + 1);
        // floor((2 sum + count) / (2 count)); a sixth in 16 bits, exact for the sums that occur.
        const VI16 sixth = hn::Sub(
            hn::MulHigh(hn::Add(hn::Add(sum, sum), hn::Set(d, 3 + 6 * 256)), hn::Set(d, 10923)),
            hn::Set(d, 256));
        const VI16 mean = hn::IfThenElse(
            hn::Gt(count, three), hn::ShiftRight<2>(hn::Add(sum, two)),
            hn::IfThenElse(
                hn::Gt(count, two), sixth,
                hn::IfThenElse(hn::Gt(count, one), hn::ShiftRight<1>(hn::Add(sum, one)), zero)));
        const auto missing = hn::Eq(a, none);
        const VI16 even = hn::IfThenElse(missing, none,
                                         hn::Add(a, hn::ShiftRight<1>(hn::Add(below, one)))),
                   odd = hn::IfThenElse(missing, none, hn::Add(a, mean));
        if (2 * (i + lanes) <= width) {
            hn::StoreInterleaved2(even, odd, d, dst + 2 * i);
        } else {
            hn::StoreInterleaved2(even, odd, d, end);
            std::copy_n(end, width - 2 * i, dst + 2 * i);
        }
    }
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
HWY_EXPORT(BetweenRow);
HWY_EXPORT(HypothesisRow);
HWY_EXPORT(ResultRow);

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
void standing_row(Plane<const int16_t> supported, Plane<const int16_t> dense, int y,
                  const StereoConstants& c, int16_t* extent, uint8_t* dst) {
    HWY_DYNAMIC_DISPATCH(StandingRow)(supported, dense, y, c, extent, dst);
}
void between_row(Plane<const int16_t> samples, int samples_x, int samples_y, int width, int y,
                 int16_t* dst) {
    HWY_DYNAMIC_DISPATCH(BetweenRow)(samples, samples_x, samples_y, width, y, dst);
}
void hypothesis_row(Plane<const int16_t> samples, int samples_x, int samples_y, int width, int y,
                    int16_t* dst) {
    HWY_DYNAMIC_DISPATCH(HypothesisRow)(samples, samples_x, samples_y, width, y, dst);
}
void result_row(Plane<const int16_t> samples, int samples_y, int width, int range, int y,
                int16_t* dst) {
    HWY_DYNAMIC_DISPATCH(ResultRow)(samples, samples_y, width, range, y, dst);
}

}  // namespace defrec::cpu
#endif
