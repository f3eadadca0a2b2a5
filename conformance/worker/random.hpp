// Random numbers of the cases: SplitMix64, the same on every machine, as the standard's
// distributions are not.
#pragma once
#include <cmath>
#include <cstdint>
#include <string_view>

#include "sdk/base/util/fnv1a.hpp"

namespace defrec::conformance {

class Random {
  public:
    explicit Random(uint64_t seed) : state_(seed) {}
    // Another sequence for each text.
    explicit Random(std::string_view text) : state_(fnv1a(kFnvBasis, text.data(), text.size())) {}

    uint64_t next() {
        uint64_t z = state_ += 0x9e3779b97f4a7c15;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
        z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
        return z ^ (z >> 31);
    }
    uint32_t below(uint32_t count) { return uint32_t((next() >> 32) * count >> 32); }
    double unit() { return double(next() >> 11) * 0x1p-53; }  // 0 <= unit < 1
    double within(double minimum, double maximum) { return minimum + (maximum - minimum) * unit(); }
    // Mean 0, standard deviation 1: twelve uniform numbers, which needs no function of the
    // machine's library.
    double normal() {
        double sum = -6;
        for (int i = 0; i < 12; ++i) sum += unit();
        return sum;
    }

  private:
    uint64_t state_;
};

}  // namespace defrec::conformance
