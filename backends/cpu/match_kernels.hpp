// The inner loop of the stage match, compiled for every instruction set and chosen at run time. Not
// the stage: see match.cpp.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

namespace defrec::cpu {

// Descriptors in groups of 16: of each of the four 64-bit words first those of the even members,
// then those of the odd ones.
constexpr size_t kMatchGroup = 16;
struct MatchGroup {
    alignas(64) uint64_t word[4][2][kMatchGroup / 2];
};

using MatchDescriptor = std::array<uint64_t, 4>;
using MatchKeys = std::array<uint32_t, 3>;
constexpr uint32_t kNoKey = 0xffffffff;

// Compares landmarks [first, last) with all groups. Keys are distance << 16 | index, so the least
// is the nearest, then the first.
struct MatchBlock {
    const MatchDescriptor* landmarks;
    uint32_t first, last;
    const MatchGroup* groups;
    size_t group_count;
    const uint32_t* index;  // of each member of the groups, kNoKey where there is none
    MatchKeys* best;        // keys of each landmark's three nearest features
    uint32_t* nearest;      // key of each member's nearest landmark of this block; kNoKey at first
};
void match_block(const MatchBlock& block);

}  // namespace defrec::cpu
