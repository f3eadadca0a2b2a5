// A share with which counts are compared without rounding.
#pragma once
#include <cstdint>

namespace defrec {

struct Ratio {
    uint64_t numerator, denominator;
};

}  // namespace defrec
