// See frozen_regions.hpp.
#include "sdk/tracking/monitors/frozen_regions.hpp"

#include <algorithm>
#include <utility>

#include "sdk/base/util/word_hash.hpp"
#include "sdk/tracking/decisions/images.hpp"

namespace defrec {
namespace {

using decisions::FrozenImages;

constexpr uint32_t kSide = FrozenImages::kBlock;

size_t place(double at, uint32_t blocks) {
    return static_cast<size_t>(std::clamp(at / kSide, 0.0, blocks - 1.0));
}

}  // namespace

FrozenRegions::FrozenRegions(uint32_t width, uint32_t height)
    : width_(width),
      height_(height),
      columns_(std::max(1u, width / kSide)),
      rows_(std::max(1u, height / kSide)),
      blocks_(size_t{columns_} * rows_) {}

uint32_t FrozenRegions::first_row(size_t part) const {
    return static_cast<uint32_t>(rows_ * part / kParts);
}

RowRange FrozenRegions::rows_of(size_t part) const {
    return {kSide * first_row(part), part + 1 < kParts ? kSide * first_row(part + 1) : height_};
}

void FrozenRegions::add_part(const uint8_t* gray, size_t part) {
    const uint32_t side_x = std::min(kSide, width_), side_y = std::min(kSide, height_);
    for (uint32_t row = first_row(part); row < first_row(part + 1); ++row) {
        for (uint32_t column = 0; column < columns_; ++column) {
            WordHash hash;
            uint8_t least = 255, most = 0;
            for (uint32_t y = FrozenImages::kFirstRow; y < side_y; y += FrozenImages::kRowStep) {
                const uint8_t* pixels =
                    gray + (size_t{row} * kSide + y) * width_ + size_t{column} * kSide;
                for (uint32_t x = 0; x < side_x; ++x) {
                    least = std::min(least, pixels[x]);
                    most = std::max(most, pixels[x]);
                }
                for (uint32_t x = 0; x + sizeof(uint64_t) <= side_x; x += sizeof(uint64_t))
                    hash.add(pixels + x);
            }
            Block& block = blocks_[size_t{row} * columns_ + column];
            const bool had_texture =
                std::exchange(block.has_texture, most - least >= FrozenImages::kMinContrast);
            block.is_frozen =
                has_image_ && had_texture && block.has_texture && hash.value() == block.hash;
            if (!block.is_frozen) block.others_px = 0;
            block.hash = hash.value();
        }
    }
}

void FrozenRegions::end_image() {
    size_t textured = 0, frozen = 0;
    for (const Block& block : blocks_) {
        textured += block.has_texture;
        frozen += block.is_frozen;
    }
    has_image_ = true;
    share_ = textured > 0 ? static_cast<double>(frozen) / static_cast<double>(textured) : 0;
}

void FrozenRegions::others_moved(double px) {
    for (Block& block : blocks_)
        if (block.is_frozen) block.others_px += static_cast<float>(px);
}

bool FrozenRegions::is_stale(double x, double y) const {
    const Block& block = blocks_[block_of(x, y)];
    return block.is_frozen && block.others_px >= FrozenImages::kStaleMotion;
}

size_t FrozenRegions::block_of(double x, double y) const {
    return place(y, rows_) * columns_ + place(x, columns_);
}

}  // namespace defrec
