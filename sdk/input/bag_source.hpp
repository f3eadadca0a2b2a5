// Images of both views from a bag of ROS 2, paired by their stamps.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "sdk/input/bag_options.hpp"
#include "sdk/input/frame_pairs.hpp"

namespace defrec::cli {

// One thread at a time.
class BagSource {
  public:
    // Throws CliError(kInput) where the bag cannot be read, or its topics are not told.
    explicit BagSource(const BagOptions& options);
    ~BagSource();
    BagSource(const BagSource&) = delete;
    BagSource& operator=(const BagSource&) = delete;

    // The next pair; its times grow, and are ms since the left view's first image. Where each image
    // holds both views it is whole in `left`, and `right` has none. False at the end, and where
    // something is wrong, which fault() then says.
    bool read(CameraPair& pair);
    const std::string& fault() const;
    // Images per second of the left view by the stamps of its first images; 0 where they do not
    // say.
    double fps() const;
    // How many pairs there are at most, by the number of messages.
    std::int64_t claimed() const;
    BagFacts facts() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace defrec::cli
