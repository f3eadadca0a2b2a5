// The end of stereo: speckles dropped, small holes filled. Plain loops, compiled for each of
// Highway's targets.
#include <algorithm>

#include "backends/cpu/stereo_kernels.hpp"
#include "backends/stages/stereo.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/stereo_finish.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {

// Counts and, with a hypothesis, deviations from it over the columns of a window, with zeros on
// both sides of the row.
struct ColumnCounts {
    int16_t counts_memory[DEFREC_MAX_SIDE + 2 * kMargin] = {};
    int16_t sums_memory[DEFREC_MAX_SIDE + 2 * kMargin] = {};
    int16_t* counts = counts_memory + kMargin;
    int16_t* sums = sums_memory + kMargin;
};

void AddCounts(const int16_t* HWY_RESTRICT row, int width, int sign, int16_t* HWY_RESTRICT counts) {
    for (int x = 0; x < width; ++x)
        counts[x] = int16_t(counts[x] + (row[x] != kNoDisparity ? sign : 0));
}

void AddDeviations(const int16_t* HWY_RESTRICT row, const int16_t* HWY_RESTRICT hypothesis,
                   int width, int sign, int16_t* HWY_RESTRICT sums) {
    for (int x = 0; x < width; ++x)
        sums[x] = int16_t(sums[x] + (row[x] != kNoDisparity ? sign * (row[x] - hypothesis[x]) : 0));
}

void WindowOf(const int16_t* HWY_RESTRICT columns, int width, int radius,
              int16_t* HWY_RESTRICT windows) {
    for (int x = 0; x < width; ++x) windows[x] = columns[x];
    for (int u = 1; u <= radius; ++u)
        for (int x = 0; x < width; ++x)
            windows[x] = int16_t(windows[x] + columns[x - u] + columns[x + u]);
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

void DropSpecklesRows(Plane<const int16_t> evidence, int width, int height, int y0, int y1,
                      const StereoConstants& c, Plane<int16_t> dst, Plane<uint8_t> confidence) {
    constexpr int kRadius = 4;
    const int support = c.support;
    ColumnCounts columns;
    int16_t counts[DEFREC_MAX_SIDE];
    for (int y = y0; y < y1; ++y) {
        MoveTo(y, y0, kRadius, height,
               [&](int v, int sign) { AddCounts(evidence.row(v), width, sign, columns.counts); });
        WindowOf(columns.counts, width, kRadius, counts);
        const int16_t* HWY_RESTRICT from = evidence.row(y);
        int16_t* HWY_RESTRICT to = dst.row(y);
        uint8_t* HWY_RESTRICT sure = confidence.row(y);
        for (int x = 0; x < width; ++x) {
            const bool dropped = 25 * counts[x] < 81 * support;
            to[x] = dropped ? int16_t(kNoDisparity) : from[x];
            sure[x] = dropped ? uint8_t{0} : sure[x];
        }
        std::fill_n(to + width, kMargin, int16_t(kNoDisparity));
    }
}

void FillSmallRows(Plane<const int16_t> evidence, Plane<const int16_t> hypothesis, int width,
                   int height, int y0, int y1, const StereoConstants& c, Plane<int16_t> dst,
                   Plane<uint8_t> confidence) {
    const int radius = c.fill_radius, side = 2 * radius + 1;
    ColumnCounts columns;
    int16_t counts[DEFREC_MAX_SIDE], sums[DEFREC_MAX_SIDE];
    for (int y = y0; y < y1; ++y) {
        MoveTo(y, y0, radius, height, [&](int v, int sign) {
            AddCounts(evidence.row(v), width, sign, columns.counts);
            AddDeviations(evidence.row(v), hypothesis.row(v), width, sign, columns.sums);
        });
        WindowOf(columns.counts, width, radius, counts);
        WindowOf(columns.sums, width, radius, sums);
        const int16_t* from = evidence.row(y);
        const int16_t* guess = hypothesis.row(y);
        int16_t* to = dst.row(y);
        uint8_t* sure = confidence.row(y);
        std::copy_n(from, width + kMargin, to);
        for (int x = 0; x < width; ++x) {
            const int n = counts[x];
            if (from[x] != kNoDisparity || 2 * n < side * side) continue;
            const int a = 2 * sums[x] + n, b = 2 * n;
            const int mean = a / b - (a % b != 0 && a < 0);
            to[x] = int16_t(std::max(0, guess[x] + mean));
            sure[x] = kFilledConfidence;
        }
    }
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace defrec::cpu {

HWY_EXPORT(DropSpecklesRows);
HWY_EXPORT(FillSmallRows);

void drop_speckles_rows(Plane<const int16_t> evidence, int width, int height, int y0, int y1,
                        const StereoConstants& c, Plane<int16_t> dst, Plane<uint8_t> confidence) {
    HWY_DYNAMIC_DISPATCH(DropSpecklesRows)
    (evidence, width, height, y0, y1, c, dst, confidence);
}
void fill_small_rows(Plane<const int16_t> evidence, Plane<const int16_t> hypothesis, int width,
                     int height, int y0, int y1, const StereoConstants& c, Plane<int16_t> dst,
                     Plane<uint8_t> confidence) {
    HWY_DYNAMIC_DISPATCH(FillSmallRows)
    (evidence, hypothesis, width, height, y0, y1, c, dst, confidence);
}

}  // namespace defrec::cpu
#endif
