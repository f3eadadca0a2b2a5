// What a frame's images tell before anything is found in them.
#pragma once
#include <array>
#include <cstdint>
#include <memory>

#include "sdk/rig/rig.hpp"
#include "sdk/tracking/monitors/frozen_regions.hpp"
#include "sdk/tracking/monitors/stream_check.hpp"

namespace defrec {

class Services;

class ImageCheck {
  public:
    explicit ImageCheck(std::shared_ptr<const Rig> rig);

    // A view's gray values in tight rows, as the camera gave them or rectified.
    struct View {
        const uint8_t* gray;
        bool is_rectified;
    };
    struct Frame {
        int64_t timestamp_ns;
        uint32_t field;  // DEFREC_FIELD_*
        std::array<View, 2> views;
    };
    // In the order of the frames. helpers: whose threads take part; nullptr: none.
    StreamCheck::Finding look_at(const Frame& frame, const Services* helpers);
    // Blocks of the views of the frame that was looked at last.
    std::array<FrozenRegions, 2>& blocks() { return blocks_[kind_]; }

  private:
    std::shared_ptr<const Rig> rig_;
    StreamCheck stream_;
    // A picture of one field differs from one of the other where nothing moved, so bottom fields
    // have blocks of their own.
    std::array<std::array<FrozenRegions, 2>, 2> blocks_;
    size_t kind_ = 0;  // 1: the frame that was looked at last was a bottom field
};

}  // namespace defrec
