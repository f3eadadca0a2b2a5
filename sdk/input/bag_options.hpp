// Which bag is read, and what became of its images.
#pragma once

#include <string>

#include "sdk/input/camera_counts.hpp"

namespace defrec::cli {

struct BagOptions {
    bool is_given() const { return !path.empty(); }

    std::string path;                     // file or folder; empty: no bag
    std::string left_topic, right_topic;  // empty: by their names
};

// What is read of a bag, and what became of it.
struct BagFacts {
    std::string left_topic, right_topic;
    PairCounts pairs;

    // A sentence where images had no partner, or were in pairs of different times; else empty.
    std::string remark() const;
};

}  // namespace defrec::cli
