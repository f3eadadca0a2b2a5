// See atlas.hpp.
#include "sdk/template/atlas.hpp"

#include <algorithm>

#include "sdk/template/decisions.hpp"

namespace defrec {
namespace {

// Pieces keep their places in the blocks of 8x8 px that halving an image three times averages.
constexpr uint32_t kBlock = 8;

// Makes room for a piece of that size behind the others; false where the image has none.
bool fits_image(const TemplateData& data, AtlasEnd& end, uint32_t width, uint32_t height) {
    if (end.x + width > data.width) end = {0, end.y + end.shelf, 0};
    return end.x + width <= data.width && end.y + height <= data.height;
}

}  // namespace

std::optional<AtlasPlace> add_to_atlas(TemplateData& data, const uint8_t* gray, PixelBox piece) {
    const size_t image_bytes = size_t{data.width} * data.height;
    piece.x0 -= piece.x0 % kBlock;
    piece.y0 -= piece.y0 % kBlock;
    piece.x1 = std::min(data.width, (piece.x1 + kBlock - 1) / kBlock * kBlock);
    piece.y1 = std::min(data.height, (piece.y1 + kBlock - 1) / kBlock * kBlock);
    const uint32_t width = piece.x1 - piece.x0, height = piece.y1 - piece.y0;
    AtlasEnd end = data.atlas_end;
    if (data.views() == 1 || !fits_image(data, end, width, height)) {
        if (data.views() == decisions::AtlasLimits::kMaxViews) return std::nullopt;
        data.image.resize(data.image.size() + image_bytes);
        end = {};
    }
    const auto view = static_cast<int32_t>(data.views() - 1);
    uint8_t* image = data.image.data() + static_cast<size_t>(view) * image_bytes;
    for (uint32_t y = 0; y < height; ++y)
        std::copy_n(gray + size_t{piece.y0 + y} * data.width + piece.x0, width,
                    image + size_t{end.y + y} * data.width + end.x);
    const AtlasPlace place{view, int64_t{end.x} - piece.x0, int64_t{end.y} - piece.y0};
    const auto to_block = [](uint32_t length) { return (length + kBlock - 1) / kBlock * kBlock; };
    end.x = std::min(data.width, end.x + to_block(width));
    end.shelf = std::max(end.shelf, std::min(data.height - end.y, to_block(height)));
    data.atlas_end = end;
    return place;
}

}  // namespace defrec
