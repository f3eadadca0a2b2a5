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
    // The next frame's, in the order of the frames. helpers: whose threads take part; nullptr:
    // none.
    StreamCheck::Finding look_at(uint64_t frame, int64_t timestamp_ns,
                                 const std::array<View, 2>& views, const Services* helpers);
    // Blocks of the views.
    std::array<FrozenRegions, 2>& blocks() { return blocks_; }

  private:
    std::shared_ptr<const Rig> rig_;
    StreamCheck stream_;
    std::array<FrozenRegions, 2> blocks_;
};

}  // namespace defrec
