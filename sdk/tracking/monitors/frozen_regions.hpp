// Which parts of a view are frozen: they show, bit for bit, what they showed in the frame before.
// A camera's noise leaves no textured block as it was; a transmission that lost packets does, and
// so does what is drawn over the picture.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sdk/tracking/monitors/frame_state.hpp"

namespace defrec {

class FrozenRegions {
  public:
    FrozenRegions(uint32_t width, uint32_t height);

    // The next frame's image, tight rows of gray values, in parts that threads share: each once, in
    // any order.
    static constexpr size_t kParts = 4;
    void add_part(const uint8_t* gray, size_t part);
    // All parts were added.
    void end_image();
    // The rows of a part. Those below the last blocks are the last part's.
    RowRange rows_of(size_t part) const;
    // Share of the blocks with texture that are frozen; 0 where none has any.
    double share() const { return share_; }
    bool any() const { return share_ > 0; }
    // Whether the block of a pixel is frozen. Beyond the image: that of the nearest pixel.
    bool is_frozen(double x, double y) const { return blocks_[block_of(x, y)].is_frozen; }

    // Tissue that is seen elsewhere has moved by so much, px, since the frame before.
    void others_moved(double px);
    // Whether what is seen elsewhere has moved on since the block of a pixel is frozen.
    bool is_stale(double x, double y) const;

  private:
    struct Block {
        uint64_t hash = 0;
        bool has_texture = false, is_frozen = false;
        float others_px = 0;  // motion elsewhere since it is frozen
    };
    uint32_t first_row(size_t part) const;  // of blocks
    size_t block_of(double x, double y) const;

    uint32_t width_, height_, columns_, rows_;
    std::vector<Block> blocks_;  // row by row
    double share_ = 0;
    bool has_image_ = false;
};

}  // namespace defrec
