// Hamming distances between all landmarks and all live features, both directions in one pass.
#include "backends/cpu/match_kernels.hpp"

// The set of instructions that counts bits, which Highway leaves out unless it is asked for.
#define HWY_WANT_AVX3_DL

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "backends/cpu/match_hamming.cpp"
#include <hwy/foreach_target.h>
// after foreach_target.h
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace defrec::cpu::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D64 = hn::CappedTag<uint64_t, kMatchGroup / 2>;
using D32 = hn::RepartitionToNarrow<D64>;
using D8 = hn::Repartition<uint8_t, D64>;
using V64 = hn::Vec<D64>;
using V32 = hn::Vec<D32>;
using V8 = hn::Vec<D8>;

#if HWY_TARGET <= HWY_AVX3_DL
// Bits set in each lane; of several that were added up.
V64 count_bits(V64 v) { return hn::PopulationCount(v); }
V64 total_bits(V64 sum) { return sum; }
#else
// Bits set in each byte; in each lane, of several that were added up.
V64 total_bits(V8 sum) { return hn::SumsOf8(sum); }
V8 count_bits(V64 v) {
    alignas(16) static constexpr uint8_t kBits[16] = {0, 1, 1, 2, 1, 2, 2, 3,
                                                      1, 2, 2, 3, 2, 3, 3, 4};
    const D8 d;
    const V8 table = hn::LoadDup128(d, kBits), nibble = hn::Set(d, 15);
    const V8 low = hn::And(hn::BitCast(d, v), nibble);
    const V8 high = hn::And(hn::BitCast(d, hn::ShiftRight<4>(v)), nibble);
    return hn::Add(hn::TableLookupBytes(table, low), hn::TableLookupBytes(table, high));
}
#endif

struct Landmark {
    V64 word[4];
    V32 best[3];  // in each lane the least keys so far, in order
};

// Distance of one landmark to as many members as a vector has 64-bit lanes.
V64 distance(const Landmark& landmark, const uint64_t (*word)[2][kMatchGroup / 2], size_t parity,
             size_t lane) {
    const D64 d;
    auto sum = count_bits(hn::Xor(landmark.word[0], hn::LoadU(d, word[0][parity] + lane)));
    for (size_t w = 1; w < 4; ++w)
        sum = hn::Add(sum,
                      count_bits(hn::Xor(landmark.word[w], hn::LoadU(d, word[w][parity] + lane))));
    return total_bits(sum);
}

// The three least keys of all lanes.
void take_best(V32* best, MatchKeys& keys) {
    const D32 d;
    for (size_t place = 0; place < 3; ++place) {
        const V32 minimum = hn::MinOfLanes(d, best[0]);
        keys[place] = hn::GetLane(minimum);
        const auto taken = hn::Eq(best[0], minimum);
        best[0] = hn::IfThenElse(taken, best[1], best[0]);
        best[1] = hn::IfThenElse(taken, best[2], best[1]);
    }
}

// kTogether landmarks share the loads of a group.
template <size_t kTogether>
void compare(const MatchBlock& block, uint32_t first) {
    const D64 d64;
    const D32 d32;
    Landmark landmark[kTogether];
    for (size_t k = 0; k < kTogether; ++k) {
        for (size_t w = 0; w < 4; ++w)
            landmark[k].word[w] = hn::Set(d64, block.landmarks[first + k][w]);
        landmark[k].best[0] = landmark[k].best[1] = landmark[k].best[2] = hn::Set(d32, kNoKey);
    }
    for (size_t g = 0; g < block.group_count; ++g)
        for (size_t lane = 0; lane < kMatchGroup / 2; lane += hn::Lanes(d64)) {
            const size_t member = g * kMatchGroup + 2 * lane;
            const V32 index = hn::LoadU(d32, block.index + member);
            V32 nearest = hn::LoadU(d32, block.nearest + member);
            for (size_t k = 0; k < kTogether; ++k) {
                const V64 even = distance(landmark[k], block.groups[g].word, 0, lane),
                          odd = distance(landmark[k], block.groups[g].word, 1, lane);
                const V32 shifted =
                    hn::BitCast(d32, hn::Or(hn::ShiftLeft<16>(even), hn::ShiftLeft<48>(odd)));
                const V32 key = hn::Or(shifted, index);
                V32* best = landmark[k].best;
                const V32 behind_first = hn::Max(best[0], key);
                best[0] = hn::Min(best[0], key);
                const V32 behind_second = hn::Max(best[1], behind_first);
                best[1] = hn::Min(best[1], behind_first);
                best[2] = hn::Min(best[2], behind_second);
                nearest = hn::Min(nearest, hn::Or(shifted, hn::Set(d32, uint32_t(first + k))));
            }
            hn::StoreU(nearest, d32, block.nearest + member);
        }
    for (size_t k = 0; k < kTogether; ++k) take_best(landmark[k].best, block.best[first + k]);
}

void match_block(const MatchBlock& block) {
    uint32_t i = block.first;
    for (; i + 2 <= block.last; i += 2) compare<2>(block, i);
    for (; i < block.last; ++i) compare<1>(block, i);
}

}  // namespace defrec::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace defrec::cpu {

HWY_EXPORT(match_block);
void match_block(const MatchBlock& block) { HWY_DYNAMIC_DISPATCH(match_block)(block); }

}  // namespace defrec::cpu
#endif
