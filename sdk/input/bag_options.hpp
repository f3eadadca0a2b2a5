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

// The topics that are read of a bag, and what became of their images.
struct BagFacts {
    std::string left_topic, right_topic;
    PairCounts pairs;
    std::string changed_info;  // topic of a camera_info that changes in the recording; or empty

    // Sentences that users are to be told of the images; empty where there are none.
    std::string remark() const;
};

}  // namespace defrec::cli
