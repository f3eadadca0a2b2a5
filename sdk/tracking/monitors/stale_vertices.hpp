// The vertices that are seen in a part of a view that stands still while the rest moves on.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <numeric>
#include <span>
#include <vector>

#include "sdk/rig/rig.hpp"
#include "sdk/tracking/monitors/frozen_regions.hpp"

namespace defrec {

class StaleVertices {
  public:
    // Finds those of a frame that was followed from the one before; is_rectified: the blocks are of
    // the view's rectified image, else of the raw one. The blocks are told how far the rest moved.
    // seen_left: whether the left view shows a vertex, in a frame that was followed by it alone.
    void find(const Rig& rig, std::array<FrozenRegions, 2>& blocks,
              const std::array<bool, 2>& is_rectified,
              std::span<const defrec_surface_sample> before,
              std::span<const defrec_surface_sample> now, std::span<const uint8_t> seen_left = {});
    void set_all(size_t vertices);
    // Once for each frame that is registered: how many stand still in a row, up to this one.
    uint32_t count_frozen(bool is_frozen) {
        frozen_frames_ = is_frozen ? frozen_frames_ + 1 : 0;
        return frozen_frames_;
    }
    void clear();

    // As FrameEvidence::stale_views.
    std::span<const uint8_t> views() const { return views_; }
    // The views of all vertices together.
    uint8_t of_views() const {
        return std::accumulate(views_.begin(), views_.end(), uint8_t{0}, std::bit_or<>());
    }
    // Share of the vertices in the image.
    double share() const { return share_; }

  private:
    std::vector<uint8_t> views_;
    std::vector<float> steps_;  // px^2, of those that are seen now
    double share_ = 0;
    uint32_t frozen_frames_ = 0;
};

}  // namespace defrec
