// Which topics of a bag carry the two views.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sdk/bag/bag_reader.hpp"

namespace defrec::cli {

struct StereoTopics {
    BagTopic left;
    std::optional<BagTopic> right;  // empty: each image of `left` holds both views
};

// left, right: names that were asked for; empty where they are to be found by "left" and "right" in
// them. Throws CliError(kInput), with the images that the bag has, where a name is of no images,
// and where what was not named is not one pair of topics alone. bag: its name, for messages.
StereoTopics choose_topics(const std::string& bag, const std::vector<BagTopic>& topics,
                           const std::string& left, const std::string& right);

// The topic whose images hold both views. name: likewise; empty: the only one of images.
StereoTopics choose_stereo_topic(const std::string& bag, const std::vector<BagTopic>& topics,
                                 const std::string& name);

// By the conventions of ROS (image_pipeline): the topic of the camera_info beside an image's, and
// whether the images of a topic are rectified.
std::string camera_info_topic(const std::string& image_topic);
bool is_rectified_topic(const std::string& image_topic);

}  // namespace defrec::cli
