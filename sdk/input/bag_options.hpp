// Which bag is read, and what became of its images.
#pragma once

#include <string>
#include <vector>

#include "sdk/bag/stereo_topics.hpp"
#include "sdk/input/camera_counts.hpp"

namespace defrec::cli {

struct BagOptions {
    bool is_given() const { return !path.empty(); }

    std::string path;                     // file or folder; empty: no bag
    std::string left_topic, right_topic;  // empty: by their names
    bool has_stereo_images = false;       // each image holds both views
    std::string stereo_topic{};           // then of these; empty: the only one of images
};

// The topics of the bag that carry the views, of those that it has. Throws CliError(kInput).
inline StereoTopics views_of(const BagOptions& options, const std::vector<BagTopic>& topics) {
    return options.has_stereo_images
               ? choose_stereo_topic(options.path, topics, options.stereo_topic)
               : choose_topics(options.path, topics, options.left_topic, options.right_topic);
}

// The topics that are read of a bag, and what became of their images.
struct BagFacts {
    std::string left_topic, right_topic;  // the latter empty where each image holds both views
    PairCounts pairs;
    std::string changed_info;  // topic of a camera_info that changes in the recording; or empty

    // Sentences that users are to be told of the images; empty where there are none.
    std::string remark() const;
};

}  // namespace defrec::cli
