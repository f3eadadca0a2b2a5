#include "sdk/template/atlas.hpp"

#include <doctest/doctest.h>

#include <algorithm>

#include "sdk/template/decisions.hpp"

using namespace defrec;

namespace {

constexpr uint32_t kWidth = 100, kHeight = 60;

TemplateData first_view() {
    TemplateData data;
    data.width = kWidth;
    data.height = kHeight;
    data.image.assign(kWidth * kHeight, 1);
    return data;
}

uint8_t gray_at(const TemplateData& data, int32_t view, int64_t u, int64_t v) {
    return data.image[static_cast<size_t>((view * kHeight + v) * kWidth + u)];
}

}  // namespace

TEST_CASE("pieces lie side by side in the atlas, each as it was in its image") {
    TemplateData data = first_view();
    struct Piece {
        PixelBox box;
        AtlasPlace place;
        uint8_t gray;
    };
    std::vector<Piece> pieces;
    const PixelBox boxes[] = {{70, 0, 100, 60}, {60, 5, 100, 60}, {0, 0, 17, 23},
                              {3, 41, 20, 60},  {0, 0, 100, 60},  {40, 20, 60, 40}};
    for (const PixelBox& box : boxes) {
        const auto gray = static_cast<uint8_t>(10 + 10 * pieces.size());
        const std::vector<uint8_t> image(kWidth * kHeight, gray);
        const auto place = add_to_atlas(data, image.data(), box);
        REQUIRE(place);
        CHECK(place->view >= 1);
        CHECK(static_cast<size_t>(place->view) < data.views());
        CHECK(place->du % 8 == 0);
        CHECK(place->dv % 8 == 0);
        pieces.push_back({box, *place, gray});
    }
    for (const Piece& piece : pieces)
        for (uint32_t v = piece.box.y0; v < piece.box.y1; ++v)
            for (uint32_t u = piece.box.x0; u < piece.box.x1; ++u)
                REQUIRE(gray_at(data, piece.place.view, u + piece.place.du, v + piece.place.dv) ==
                        piece.gray);
    CHECK(std::all_of(data.image.begin(), data.image.begin() + kWidth * kHeight,
                      [](uint8_t gray) { return gray == 1; }));
    CHECK(pieces[0].place.view == pieces[1].place.view);
    CHECK(data.views() < 1 + std::size(boxes));
}

TEST_CASE("when no view is left there is no place, and what there is stays") {
    TemplateData data = first_view();
    const std::vector<uint8_t> image(kWidth * kHeight, 9);
    for (size_t i = 1; i < decisions::AtlasLimits::kMaxViews; ++i)
        REQUIRE(add_to_atlas(data, image.data(), {0, 0, kWidth, kHeight}));
    CHECK_FALSE(add_to_atlas(data, image.data(), {0, 0, 8, 8}));
    CHECK(data.views() == decisions::AtlasLimits::kMaxViews);
}
