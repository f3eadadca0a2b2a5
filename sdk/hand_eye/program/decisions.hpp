// The numbers by which `defrec handeye` decides, as scripts/decisions/header.py reads them: unit |
// what it decides | source.
#pragma once

#include <cstddef>

namespace defrec::decisions {

// The files that `defrec handeye` reads.
struct HandEyeFiles {
    // bytes | of a file, at most | set by hand: an hour at 1000 Hz
    static constexpr std::size_t kMaxBytes = 500000000;
    // 1 | a quaternion's length differs from 1 by at most that | files round to four digits
    static constexpr double kQuaternion = 1e-3;
};

}  // namespace defrec::decisions
