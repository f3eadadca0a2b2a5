// Speckles dropped from stereo's samples, small holes filled. Mostly plain loops, compiled for each
// of Highway's targets.
#include <algorithm>

#include "backends/cpu/stereo_kernels.hpp"
#include "backends/stages/stereo.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/stereo_finish.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// A sum over the columns of a window, with zeros on both sides of the row.
struct ColumnSums {
    explicit ColumnSums(int width) { std::fill_n(memory, width + 2 * kMargin, int16_t{0}); }
    int16_t memory[DEFREC_MAX_SIDE / 2 + 2 * kMargin];
    int16_t* row = memory + kMargin;
};

void AddCounts(const int16_t* HWY_RESTRICT row, int width, int sign, int16_t* HWY_RESTRICT counts) {
    for (int x = 0; x < width; ++x)
        counts[x] = int16_t(counts[x] + (row[x] != kNoDisparity ? sign : 0));
}

// hypothesis: of all pixels.
void AddDeviations(const int16_t* HWY_RESTRICT row, const int16_t* HWY_RESTRICT hypothesis,
                   int width, int sign, int16_t* HWY_RESTRICT sums) {
    for (int x = 0; x < width; ++x)
        sums[x] =
            int16_t(sums[x] + (row[x] != kNoDisparity ? sign * (row[x] - hypothesis[2 * x]) : 0));
}

// windows: of whole vectors.
void WindowOf(const int16_t* HWY_RESTRICT columns, int width, int radius,
              int16_t* HWY_RESTRICT windows) {
    const hn::ScalableTag<int16_t> d;
    for (int x = 0; x < width; x += int(hn::Lanes(d))) {
        auto sum = hn::LoadU(d, columns + x);
        for (int u = 1; u <= radius; ++u)
            sum =
                hn::Add(sum, hn::Add(hn::LoadU(d, columns + x - u), hn::LoadU(d, columns + x + u)));
        hn::StoreU(sum, d, windows + x);
    }
}

// Calls move(row, sign) for the rows that enter (+1) and leave (-1) so that the window is centred
// on y.
template <class Move>
HWY_INLINE void MoveTo(int y, int y0, int radius, int height, Move&& move) {
    if (y == y0) {
        for (int v = std::max(0, y - radius); v <= std::min(height - 1, y + radius); ++v)
            move(v, 1);
        return;
    }
    if (y + radius < height) move(y + radius, 1);
    if (y - radius - 1 >= 0) move(y - radius - 1, -1);
}

void DropSpecklesRows(Plane<const int16_t> evidence, int y0, int y1, const StereoConstants& c,
                      Plane<int16_t> dst, Plane<uint8_t> confidence) {
    const int width = c.samples_x, height = c.samples_y, support = c.support;
    ColumnSums columns(width);
    int16_t counts[DEFREC_MAX_SIDE / 2 + kMargin];
    for (int y = y0; y < y1; ++y) {
        MoveTo(y, y0, kSpeckleRadius, height,
               [&](int v, int sign) { AddCounts(evidence.row(v), width, sign, columns.row); });
        WindowOf(columns.row, width, kSpeckleRadius, counts);
        const int16_t* HWY_RESTRICT from = evidence.row(y);
        int16_t* HWY_RESTRICT to = dst.row(y);
        const auto is_dropped = [&](int x) { return counts[x] < support; };
        for (int x = 0; x < width; ++x) to[x] = is_dropped(x) ? int16_t(kNoDisparity) : from[x];
        std::fill_n(to + width, kMargin, int16_t(kNoDisparity));
        if (confidence.data == nullptr) continue;
        uint8_t* HWY_RESTRICT sure = confidence.row(y);
        for (int x = 0; x < width; ++x) sure[x] = is_dropped(x) ? uint8_t{0} : sure[x];
    }
}

void FillSmallRows(Plane<const int16_t> evidence, Plane<const int16_t> hypothesis, int y0, int y1,
                   const StereoConstants& c, Plane<int16_t> dst, Plane<uint8_t> confidence) {
    const int width = c.samples_x, height = c.samples_y;
    const int radius = c.fill_radius, side = 2 * radius + 1;
    constexpr int kBlock = 64;  // columns that are passed over if there is nothing to fill
    ColumnSums columns(width), deviations(width);
    int16_t counts[DEFREC_MAX_SIDE / 2 + kMargin], sums[DEFREC_MAX_SIDE / 2 + kMargin];
    for (int y = y0; y < y1; ++y) {
        MoveTo(y, y0, radius, height, [&](int v, int sign) {
            AddCounts(evidence.row(v), width, sign, columns.row);
            AddDeviations(evidence.row(v), hypothesis.row(2 * v), width, sign, deviations.row);
        });
        WindowOf(columns.row, width, radius, counts);
        WindowOf(deviations.row, width, radius, sums);
        const int16_t* from = evidence.row(y);
        const int16_t* guess = hypothesis.row(2 * y);
        int16_t* to = dst.row(y);
        std::copy_n(from, width, to);
        std::fill_n(to + width, kMargin, int16_t(kNoDisparity));
        const auto is_filled = [&](int x) {
            return (from[x] == kNoDisparity) & (2 * counts[x] >= side * side);
        };
        for (int begin = 0; begin < width; begin += kBlock) {
            const int end = std::min(width, begin + kBlock);
            int any = 0;
            for (int x = begin; x < end; ++x) any |= is_filled(x);
            for (int x = begin; any != 0 && x < end; ++x) {
                if (!is_filled(x)) continue;
                const int n = counts[x], a = 2 * sums[x] + n, b = 2 * n;
                const int mean = a / b - (a % b != 0 && a < 0);
                to[x] = int16_t(std::max(0, guess[2 * x] + mean));
                if (confidence.data != nullptr) confidence.row(y)[x] = kFilledConfidence;
            }
        }
    }
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace defrec::cpu {

HWY_EXPORT(DropSpecklesRows);
HWY_EXPORT(FillSmallRows);

void drop_speckles_rows(Plane<const int16_t> evidence, int y0, int y1, const StereoConstants& c,
                        Plane<int16_t> dst, Plane<uint8_t> confidence) {
    HWY_DYNAMIC_DISPATCH(DropSpecklesRows)(evidence, y0, y1, c, dst, confidence);
}
void fill_small_rows(Plane<const int16_t> evidence, Plane<const int16_t> hypothesis, int y0, int y1,
                     const StereoConstants& c, Plane<int16_t> dst, Plane<uint8_t> confidence) {
    HWY_DYNAMIC_DISPATCH(FillSmallRows)(evidence, hypothesis, y0, y1, c, dst, confidence);
}

}  // namespace defrec::cpu
#endif
