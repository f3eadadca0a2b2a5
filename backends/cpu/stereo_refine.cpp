// Refinement of stereo at samples: correlation with the right image seen through the hypothesis,
// one pixel to either side; at full resolution also the classification. Works on tiles whose column
// sums stay in the first cache and move down by two rows.
#include <algorithm>
#include <cstring>

#include "backends/cpu/stereo_kernels.hpp"
#include "backends/stages/stereo.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/stereo_refine.cpp"
#include <hwy/foreach_target.h>

#include "backends/cpu/stereo_lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {

constexpr int kHalo = 16;           // columns on both sides of a tile that its windows reach into
constexpr int kOrigin = 2 * kHalo;  // where a tile's first column lies in its arrays
constexpr int kTileInts =
    kRefineTile + 4 * kHalo;         // with room for vectors that reach over the ends
constexpr int kMaxRows = 2 * 6 + 3;  // window rows and the two that leave
constexpr int kTileSamples = kRefineTile / 2;

enum Sum {
    kLeft,
    kLeftSquares,
    kWarped,
    kSquares = kWarped + 3,
    kProducts = kSquares + 3,
    kSums = kProducts + 3
};

// Sums over the columns of the window, and the warped rows that are inside it. Column x0 is element
// kOrigin.
struct Tile {
    alignas(64) int32_t columns[kSums][kTileInts];
    alignas(64) int16_t warped[kMaxRows][3][kTileInts];
    // Windows of a row's samples.
    alignas(64) int32_t windows[kSums][kTileSamples];
    alignas(64) int32_t window_width[kTileSamples], min_variance[kTileSamples];
    // What they are classified by; shaped: all ones at a peak of enough texture.
    alignas(64) int32_t disparity[kTileSamples], score[kTileSamples], shaped[kTileSamples];
    int min_for = 0;  // the window height that min_variance was made for
};

// The byte at place of each lane and kMore behind it in the bits above, and above those anything;
// what lies within kMargin beyond must be readable. kMore is 0 or 3.
template <int kMore>
HWY_INLINE VI32 BytesAt(const uint8_t* row, VI32 place) {
    const I32 d;
#if HWY_TARGET == HWY_AVX3
    // Mostly all lie in 64 bytes, and to permute those takes a fraction of a gather's time.
    constexpr int kBefore = 4;  // bytes, where the first lane's are not the first ones
    const hn::RebindToUnsigned<I32> du;
    const int begin = hn::GetLane(place) - kBefore;
    const auto offset = hn::BitCast(du, hn::Sub(place, hn::Set(d, begin)));
    if (hn::AllTrue(du, hn::Lt(offset, hn::Set(du, 60)))) {
        const auto bytes = hn::LoadU(du, reinterpret_cast<const uint32_t*>(row + begin));
        const auto word = hn::ShiftRight<2>(offset),
                   bits = hn::ShiftLeft<3>(hn::And(offset, hn::Set(du, 3)));
        const auto low = hn::Shr(hn::TableLookupLanes(bytes, hn::IndicesFromVec(du, word)), bits);
        if constexpr (kMore == 0) return hn::BitCast(d, low);
        const auto next = hn::IndicesFromVec(du, hn::Add(word, hn::Set(du, 1)));
        // Shifted by 32 bits nothing is left.
        return hn::BitCast(d, hn::Or(low, hn::Shl(hn::TableLookupLanes(bytes, next),
                                                  hn::Sub(hn::Set(du, 32), bits))));
    }
#endif
    return hn::GatherOffset(d, reinterpret_cast<const int32_t*>(row), place);
}

// The right image's row at x - hypothesis - 1, + 0, + 1 in half gray levels; beyond the image 0.
HWY_INLINE void WarpLanes(const RefineJob& job, int x, int y, VI32 (&out)[3]) {
    const I32 d;
    const hn::RebindToUnsigned<I32> du;
    const hn::Rebind<int16_t, I32> d16;
    const VI32 column = Columns(x);
    const VI32 disparity = hn::PromoteTo(d, hn::LoadU(d16, job.hypothesis.row(y) + x));
    const VI32 position = hn::Sub(hn::ShiftLeft<4>(column), disparity);
    const VI32 part = hn::And(position, hn::Set(d, 15)), rest = hn::Sub(hn::Set(d, 16), part);
    // Beyond the ends the image's margins repeat its last pixels.
    const VI32 first =
        hn::Min(hn::Max(hn::ShiftRight<4>(position), hn::Set(d, -3)), hn::Set(d, job.width + 1));
    const uint8_t* row = job.right.row(y) - 1;
    const auto taps = hn::BitCast(du, BytesAt<3>(row, first));
    const auto byte = hn::Set(du, 255);
    const VI32 t0 = hn::BitCast(d, hn::And(taps, byte)),
               t1 = hn::BitCast(d, hn::And(hn::ShiftRight<8>(taps), byte));
    const VI32 t2 = hn::BitCast(d, hn::And(hn::ShiftRight<16>(taps), byte)),
               t3 = hn::BitCast(d, hn::ShiftRight<24>(taps));
    const auto inside = hn::Lt(column, hn::Set(d, job.width));
    const auto blend = [&](VI32 a, VI32 b) HWY_ATTR {
        // Both products fit in one 16-bit half each.
        const VI32 taps2 = hn::Or(a, hn::ShiftLeft<16>(b)),
                   weights = hn::Or(rest, hn::ShiftLeft<16>(part));
        return hn::IfThenElseZero(
            inside, hn::ShiftRight<3>(hn::Add(PairProducts(taps2, weights), hn::Set(d, 4))));
    };
    out[0] = blend(t0, t1);
    out[1] = blend(t1, t2);
    out[2] = blend(t2, t3);
}

// Lets rows enter the columns' sums and leave them, two each, of which -1 is none.
void MoveRows(const RefineJob& job, Tile& tile, int x0, int x1, const int (&enter)[2],
              const int (&leave)[2]) {
    const I32 d;
    const hn::Rebind<int16_t, I32> d16;
    const hn::Rebind<uint8_t, I32> d8;
    const int rows = 2 * job.radius + 3, begin = std::max(0, x0 - kHalo),
              end = std::min(job.width, x1 + kHalo);
    const VI32 zero = hn::Zero(d);
    for (int x = begin; x < end; x += int(hn::Lanes(d))) {
        const int i = x - x0 + kOrigin;
        const auto inside = hn::Lt(Columns(x), hn::Set(d, job.width));
        const auto left_row = [&](int y) HWY_ATTR {
            return y < 0 ? zero
                         : hn::IfThenElseZero(inside,
                                              hn::PromoteTo(d, hn::LoadU(d8, job.left.row(y) + x)));
        };
        const auto add = [&](int sum, VI32 change) HWY_ATTR {
            int32_t* at = tile.columns[sum] + i;
            hn::Store(hn::Add(hn::Load(d, at), change), d, at);
        };
        // Values of two rows side by side, whose sums and products one instruction adds.
        const auto both = [](VI32 first, VI32 second)
                              HWY_ATTR { return hn::Or(first, hn::ShiftLeft<16>(second)); };
        const VI32 ones = hn::Set(d, 0x10001);
        const auto difference = [&](VI32 a, VI32 b, VI32 c, VI32 e) HWY_ATTR {
            return hn::Sub(PairProducts(a, b), PairProducts(c, e));
        };
        const VI32 l_in = both(left_row(enter[0]), left_row(enter[1])),
                   l_out = both(left_row(leave[0]), left_row(leave[1]));
        add(kLeft, difference(l_in, ones, l_out, ones));
        add(kLeftSquares, difference(l_in, l_in, l_out, l_out));
        VI32 in[2][3] = {{zero, zero, zero}, {zero, zero, zero}};
        for (int row = 0; row < 2; ++row)
            if (enter[row] >= 0) WarpLanes(job, x, enter[row], in[row]);
        for (int k = 0; k < 3; ++k) {
            const auto leaving = [&](int y) HWY_ATTR {
                return y < 0 ? zero : hn::PromoteTo(d, hn::Load(d16, tile.warped[y % rows][k] + i));
            };
            const VI32 w_in = both(in[0][k], in[1][k]),
                       w_out = both(leaving(leave[0]), leaving(leave[1]));
            add(kWarped + k, difference(w_in, ones, w_out, ones));
            add(kSquares + k, difference(w_in, w_in, w_out, w_out));
            add(kProducts + k, difference(l_in, w_in, l_out, w_out));
            for (int row = 0; row < 2; ++row)
                if (enter[row] >= 0)
                    hn::Store(hn::DemoteTo(d16, in[row][k]), d16,
                              tile.warped[enter[row] % rows][k] + i);
        }
    }
}

// Sums over the windows of the samples of the tile's row.
void MakeWindows(const RefineJob& job, Tile& tile, int count) {
    const I32 d;
    const int lanes = int(hn::Lanes(d));
    for (int sum = 0; sum < kSums; ++sum) {
        const int32_t* columns = tile.columns[sum] + kOrigin;
        int32_t* windows = tile.windows[sum];
        const auto even = [&](int x) HWY_ATTR {
            return hn::ConcatEven(d, hn::LoadU(d, columns + x + lanes), hn::LoadU(d, columns + x));
        };
        const auto odd = [&](int x) HWY_ATTR {
            return hn::ConcatOdd(d, hn::LoadU(d, columns + x + lanes), hn::LoadU(d, columns + x));
        };
        if (job.radius != 4) {
            for (int i = 0; i < count; i += lanes) {
                VI32 window = even(2 * i);
                for (int u = 1; u <= job.radius; ++u)
                    window = hn::Add(window, hn::Add(even(2 * i - u), even(2 * i + u)));
                hn::Store(window, d, windows + i);
            }
            continue;
        }
        const int before = -2 * lanes;
        NineColumns nine(even(before), odd(before));
        nine.Step(even(0), odd(0));
        for (int i = 0; i < count; i += lanes) {
            const int next = 2 * (i + lanes);
            hn::Store(nine.Step(even(next), odd(next)), d, windows + i);
        }
    }
}

struct Refined {
    VI32 hypothesis, disparity, score, left_variance;
    hn::Mask<I32> peak;
};

// floor(a / b) clamped to about +-40, b > 0: a float quotient put right by its remainder.
HWY_INLINE VI32 SmallQuotient(VI32 a, VI32 b) {
    const I32 d;
    const F32 df;
    const VF32 quotient = hn::Div(hn::ConvertTo(df, a), hn::ConvertTo(df, b));
    const VF32 limited = hn::Min(hn::Max(quotient, hn::Set(df, -40.0f)), hn::Set(df, 40.0f));
    VI32 q = hn::ConvertTo(d, hn::Floor(limited));
    const VI32 remainder = hn::Sub(a, hn::Mul(q, b));
    q = hn::Add(q, hn::VecFromMask(d, hn::Lt(remainder, hn::Zero(d))));
    return hn::Sub(q, hn::VecFromMask(d, hn::Gt(remainder, hn::Sub(b, hn::Set(d, 1)))));
}

// The lower half of each lane.
HWY_INLINE VI32 LowHalves(VI32 values) { return hn::ShiftRight<16>(hn::ShiftLeft<16>(values)); }

// The hypotheses of a row's samples from sample i on.
HWY_INLINE VI32 HypothesisAt(const RefineJob& job, int row, int i) {
    return LowHalves(
        hn::LoadU(I32(), reinterpret_cast<const int32_t*>(job.hypothesis.row(2 * row) + 2 * i)));
}

// at: where sample i lies in the tile.
HWY_INLINE Refined RefineLanes(const RefineJob& job, const Tile& tile, int i, int at, int row,
                               int window_height) {
    const I32 d;
    const F32 df;
    const auto window = [&](int sum) HWY_ATTR { return hn::Load(d, tile.windows[sum] + at); };
    const VI32 n = hn::Mul(hn::Load(d, tile.window_width + at), hn::Set(d, window_height));
    const VI32 s = window(kLeft);
    Refined result;
    result.left_variance = hn::Sub(hn::Mul(n, window(kLeftSquares)), hn::Mul(s, s));
    const VF32 left_inverse = hn::Mul(InverseRoot(result.left_variance), hn::Set(df, 0x1p20f));
    VI32 z[3];
    for (int k = 0; k < 3; ++k) {
        const VI32 t = window(kWarped + k);
        const VI32 covariance = hn::Sub(hn::Mul(n, window(kProducts + k)), hn::Mul(s, t));
        const VI32 variance = hn::Sub(hn::Mul(n, window(kSquares + k)), hn::Mul(t, t));
        z[k] = hn::ConvertTo(
            d,
            hn::Mul(hn::Mul(hn::ConvertTo(df, covariance), InverseRoot(variance)), left_inverse));
    }
    result.hypothesis = HypothesisAt(job, row, i);
    result.score = hn::ShiftRight<8>(hn::Max(z[1], hn::Max(z[0], z[2])));
    const VI32 bend = hn::Sub(hn::Add(z[1], z[1]), hn::Add(z[0], z[2])), one = hn::Set(d, 1),
               maximum = hn::Set(d, 16);
    const auto bent = hn::Gt(bend, hn::Zero(d));
    const VI32 divisor = hn::Add(hn::IfThenElse(bent, bend, one), hn::IfThenElse(bent, bend, one));
    const VI32 step = SmallQuotient(hn::Add(hn::ShiftLeft<4>(hn::Sub(z[0], z[2])), bend), divisor);
    result.peak = hn::And(bent, hn::Lt(hn::Abs(step), hn::Set(d, 17)));
    const VI32 moved =
        hn::Add(result.hypothesis, hn::Min(hn::Max(step, hn::Neg(maximum)), maximum));
    result.disparity = hn::IfThenElse(
        bent, hn::Min(hn::Max(moved, hn::Zero(d)), hn::Set(d, kMaxDisparity)), result.hypothesis);
    return result;
}

// Copies what belongs to the row from a vector's lanes; a tile's neighbours may be working on what
// lies beyond it.
template <class T, class D, class V>
HWY_INLINE void StoreUpTo(V values, D d, T* to, int count) {
    if (count >= int(hn::Lanes(d))) {
        hn::StoreU(values, d, to);
        return;
    }
    alignas(64) T lanes[HWY_MAX_BYTES / sizeof(T)];
    hn::StoreU(values, d, lanes);
    std::copy_n(lanes, count, to);
}

// The first lanes of as many as there are; beyond them anything.
template <class D>
HWY_INLINE hn::Vec<D> LoadUpTo(D d, const uint8_t* from, int count) {
    if (count >= int(hn::Lanes(d))) return hn::LoadU(d, from);
    alignas(64) uint8_t lanes[HWY_MAX_BYTES] = {};
    std::copy_n(from, count, lanes);
    return hn::LoadU(d, lanes);
}

// A loop of its own: with the refinement in it a processor has but one vector at work at a time.
// at: where sample i lies in the tile; count: the row's pixels from there on.
HWY_INLINE void ClassifyLanes(const RefineJob& job, const Tile& tile, int i, int row, int at,
                              int count) {
    const I32 d;
    const hn::Rebind<int16_t, I32> d16;
    const hn::Rebind<uint8_t, I32> d8;
    const hn::Repartition<uint8_t, hn::Rebind<int16_t, I32>> d_pairs;
    const VI32 zero = hn::Zero(d), byte = hn::Set(d, 255),
               refined = hn::Load(d, tile.disparity + at), score = hn::Load(d, tile.score + at),
               hypothesis = HypothesisAt(job, row, i);
    const auto half =
        hn::LoadU(d8, job.standing.row(std::min(row, job.height / 2 - 1) / 2) + i / 2);
    VI32 stands = hn::PromoteTo(d, hn::InterleaveLower(d8, half, half));
    // A masked pixel has as little evidence as a doubtful one.
    if (job.left_mask.data != nullptr) {
        const auto masks = LoadUpTo(d_pairs, job.left_mask.row(2 * row) + 2 * i, count);
        const hn::RebindToUnsigned<hn::Rebind<int16_t, I32>> du16;
        const VI32 mask = hn::And(hn::PromoteTo(d, hn::BitCast(du16, masks)), byte);
        stands = hn::IfThenElseZero(hn::Gt(mask, zero), stands);
    }
    const auto known = hn::Eq(stands, hn::Set(d, kSettled));
    const VI32 position = hn::Sub(hn::ShiftLeft<5>(Columns(i)), refined);
    const auto in_image = hn::Gt(position, hn::Set(d, -1));
    // Lanes past the row's end hold no position; they read its last pixel.
    const VI32 column = hn::Min(hn::Max(hn::ShiftRight<4>(hn::Add(position, hn::Set(d, 8))), zero),
                                hn::Set(d, job.width - 1));
    const VI32 right_mask = hn::And(BytesAt<0>(job.right_mask.row(2 * row), column), byte);
    const VI32 minimum =
        hn::IfThenElse(known, hn::Set(d, kTrustedScore - 1), hn::Set(d, job.c.refine_score - 1));
    auto good = hn::And(hn::And(hn::MaskFromVec(hn::Load(d, tile.shaped + at)), in_image),
                        hn::And(hn::Gt(score, minimum), hn::Gt(stands, zero)));
    good = hn::And(good, hn::Gt(right_mask, zero));
    const auto valid = hn::Or(good, known);
    const VI32 disparity = hn::IfThenElse(good, refined, hypothesis);
    hn::StoreU(hn::DemoteTo(d16, hn::IfThenElse(valid, disparity, hn::Set(d, kNoDisparity))), d16,
               job.result.row(row) + i);
    if (job.confidence.data == nullptr) return;
    const VI32 graded = hn::IfThenElse(good, hn::ShiftRight<4>(score), hn::ShiftRight<5>(score)),
               confidence = hn::Min(hn::Max(graded, hn::Set(d, 1)), byte);
    hn::StoreU(hn::DemoteTo(d8, hn::IfThenElseZero(valid, confidence)), d8,
               job.confidence.row(row) + i);
}

// Windows' widths, and the largest variance that is not texture for windows of this height.
void PrepareWindows(const RefineJob& job, Tile& tile, int x0, int count, int window_height) {
    if (tile.min_for == window_height) return;
    tile.min_for = window_height;
    for (int i = 0; i < count; ++i) {
        const int x = x0 + 2 * i,
                  width = std::min(x + job.radius, job.width - 1) - std::max(x - job.radius, 0) + 1;
        const int64_t n = int64_t{width} * window_height,
                      minimum =
                          (int64_t{job.c.texture} * job.c.texture * n * n + kTextureOne2 - 1) /
                              kTextureOne2 -
                          1;
        tile.window_width[i] = width;
        tile.min_variance[i] = int32_t(std::min<int64_t>(minimum, INT32_MAX));
    }
}

void RefineRow(const RefineJob& job, Tile& tile, int x0, int x1, int row) {
    const I32 d;
    const hn::Rebind<int16_t, I32> d16;
    const int y = 2 * row, window_height = std::min(y + job.radius, job.height - 1) -
                                           std::max(y - job.radius, 0) + 1;
    const int first = x0 / 2, count = (x1 - x0 + 1) / 2, lanes = int(hn::Lanes(d)),
              samples = (job.width + 1) / 2;
    PrepareWindows(job, tile, x0, count, window_height);
    MakeWindows(job, tile, count);
    for (int at = 0; at < count; at += lanes) {
        const int i = first + at;
        const Refined refined = RefineLanes(job, tile, i, at, row, window_height);
        const size_t place = size_t(row) * size_t(samples) + size_t(i);
        if (job.refined != nullptr)
            StoreUpTo(hn::DemoteTo(d16, refined.disparity), d16, job.refined + place, count - at);
        if (job.score != nullptr)
            StoreUpTo(hn::DemoteTo(d16, refined.score), d16, job.score + place, count - at);
        if (!job.classify) {
            hn::StoreU(hn::DemoteTo(d16, refined.disparity), d16, job.result.row(row) + i);
            continue;
        }
        hn::Store(refined.disparity, d, tile.disparity + at);
        hn::Store(refined.score, d, tile.score + at);
        const auto textured = hn::Gt(refined.left_variance, hn::Load(d, tile.min_variance + at));
        hn::Store(hn::VecFromMask(d, hn::And(refined.peak, textured)), d, tile.shaped + at);
    }
    for (int at = 0; job.classify && at < count; at += lanes)
        ClassifyLanes(job, tile, first + at, row, at, job.width - x0 - 2 * at);
    if (x1 == job.width) std::fill_n(job.result.row(row) + samples, kMargin, int16_t(kNoDisparity));
}

void RefineTile(const RefineJob& job, int x0, int x1, int row0, int row1) {
    Tile tile;
    std::memset(tile.columns, 0, sizeof tile.columns);
    std::memset(tile.window_width, 0, sizeof tile.window_width);
    std::memset(tile.min_variance, 0, sizeof tile.min_variance);
    const int r = job.radius, first = 2 * row0;
    const auto inside = [&](int y) { return y < job.height ? y : -1; };
    // The rows of the first window, but for the last two.
    for (int y = std::max(0, first - r); y < std::min(job.height, first + r - 1); y += 2)
        MoveRows(job, tile, x0, x1, {y, y + 1 < std::min(job.height, first + r - 1) ? y + 1 : -1},
                 {-1, -1});
    for (int row = row0; row < row1; ++row) {
        const int y = 2 * row, leave = y - r - 2;
        const auto left = [&](int v) { return row > row0 ? std::max(v, -1) : -1; };
        MoveRows(job, tile, x0, x1, {inside(y + r - 1), inside(y + r)},
                 {left(leave), left(leave + 1)});
        RefineRow(job, tile, x0, x1, row);
    }
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace defrec::cpu {

HWY_EXPORT(RefineTile);

void refine_tile(const RefineJob& job, int x0, int x1, int row0, int row1) {
    HWY_DYNAMIC_DISPATCH(RefineTile)(job, x0, x1, row0, row1);
}

}  // namespace defrec::cpu
#endif
