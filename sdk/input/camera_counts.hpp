// What became of the images of cameras.
#pragma once

#include <cstdint>

namespace defrec::cli {

struct PairCounts {
    std::int64_t pairs = 0;        // formed
    std::int64_t dropped = 0;      // of those, replaced by a newer one before anybody took them
    std::int64_t unpaired = 0;     // images of one camera without a partner
    double difference_sum_ms = 0;  // of the times within pairs, absolute
};

struct CameraCounts {
    PairCounts pairs;
    std::int64_t reconnections = 0;
    double longest_gap_ms = 0;  // between images that read() gave
};

}  // namespace defrec::cli
