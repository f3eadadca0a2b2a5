// Cells have the colours of their pixels, whatever the format and however the rows are shared.
#include "sdk/tracking/frame/colour_cells.hpp"

#include <doctest/doctest.h>

#include <array>
#include <vector>

#include "include/defrec_c.h"
#include "sdk/contract/pixel_format.hpp"
#include "sdk/tracking/decisions/unseen.hpp"

namespace {

using namespace defrec;

constexpr uint32_t kCell = 6, kWidth = decisions::TissueColours::kAcross * kCell, kHeight = 96;

struct Colour {
    uint8_t red, green, blue;
};
constexpr Colour kTissue = {160, 80, 70}, kMetal = {120, 120, 120};

Chromaticity of(const Colour& colour) {
    return Chromaticity(static_cast<float>(colour.red - colour.green),
                        static_cast<float>(colour.blue - colour.green)) /
           static_cast<float>(colour.red + colour.green + colour.blue);
}

// Tissue, with something else in a rectangle of whole cells.
struct Picture {
    Colour other = kMetal;
    uint32_t format = DEFREC_FORMAT_BGR8;
    int other_rows = -1;  // 0 or 1: the other one is on even or odd rows alone

    static bool is_other(uint32_t x, uint32_t y) {
        return x / kCell >= 10 && x / kCell < 20 && y / kCell >= 4 && y / kCell < 8;
    }
    std::vector<uint8_t> pixels() const {
        const size_t bytes = bytes_per_pixel(format);
        std::vector<uint8_t> all;
        for (uint32_t y = 0; y < kHeight; ++y)
            for (uint32_t x = 0; x < kWidth; ++x) {
                const bool shows_other =
                    is_other(x, y) && (other_rows < 0 || static_cast<int>(y % 2) == other_rows);
                const Colour& c = shows_other ? other : kTissue;
                const std::array<uint8_t, 4> bgra =
                    format == DEFREC_FORMAT_RGB8
                        ? std::array<uint8_t, 4>{c.red, c.green, c.blue, 9}
                        : std::array<uint8_t, 4>{c.blue, c.green, c.red, 9};
                all.insert(all.end(), bgra.begin(),
                           bgra.begin() + static_cast<std::ptrdiff_t>(bytes));
            }
        return all;
    }
    // bounds: of the parts in which the rows are read.
    ColourCells cells(const std::vector<size_t>& bounds = {0, kHeight},
                      uint32_t field = DEFREC_FIELD_NONE) const {
        const std::vector<uint8_t> all = pixels();
        const RawImage image{format, all.data(), kWidth * bytes_per_pixel(format), kWidth, kHeight};
        ColourCells cells;
        cells.begin(format, kWidth, kHeight);
        for (size_t i = 0; i + 1 < bounds.size(); ++i)
            cells.read_rows(image, field, {bounds[i], bounds[i + 1]});
        return cells;
    }
};

// How many pixels have another colour than these, of tissue and of the other.
size_t count_wrong(const ColourCells& cells, const Chromaticity& tissue,
                   const Chromaticity& other) {
    size_t wrong = 0;
    for (uint32_t y = 0; y < kHeight; ++y)
        for (uint32_t x = 0; x < kWidth; ++x) {
            const Chromaticity at = cells.at(x, y),
                               expected = Picture::is_other(x, y) ? other : tissue;
            wrong += !(at.isNaN().all() && expected.isNaN().all()) &&
                     !((at - expected).abs() < 1e-6f).all();
        }
    return wrong;
}

}  // namespace

TEST_CASE("cells have the colours of their pixels in each format") {
    for (const uint32_t format : {DEFREC_FORMAT_BGR8, DEFREC_FORMAT_RGB8, DEFREC_FORMAT_BGRA8}) {
        CAPTURE(format);
        CHECK(count_wrong(Picture{.format = format}.cells(), of(kTissue), of(kMetal)) == 0);
    }
}

TEST_CASE("rows that are shared give the same cells") {
    const Picture picture;
    CHECK(count_wrong(picture.cells({0, 1, 9, 10, 50, kHeight}), of(kTissue), of(kMetal)) == 0);
}

TEST_CASE("gray images, and none, have no colours") {
    CHECK_FALSE(Picture{.format = DEFREC_FORMAT_GRAY8}.cells().any());
    ColourCells cells = Picture().cells();
    cells.begin(DEFREC_FORMAT_BGR8, 0, 0);
    CHECK_FALSE(cells.any());
}

TEST_CASE("pixels that are saturated or dark show no colour") {
    const Chromaticity nothing = Chromaticity::Constant(NAN);
    for (const Colour& colour : {Colour{255, 240, 235}, Colour{9, 6, 5}})
        CHECK(count_wrong(Picture{.other = colour}.cells(), of(kTissue), nothing) == 0);
}

TEST_CASE("of an interlaced image the rows of its field are read") {
    for (const int bottom : {0, 1}) {
        const Picture picture{.other_rows = bottom};
        const std::vector<size_t> all{0, kHeight};
        CHECK(count_wrong(picture.cells(all, bottom == 1 ? DEFREC_FIELD_BOTTOM : DEFREC_FIELD_TOP),
                          of(kTissue), of(kMetal)) == 0);
        CHECK(count_wrong(picture.cells(all, bottom == 1 ? DEFREC_FIELD_TOP : DEFREC_FIELD_BOTTOM),
                          of(kTissue), of(kTissue)) == 0);
    }
}

TEST_CASE("beyond the image a pixel has the nearest cell's colour") {
    const ColourCells cells = Picture().cells();
    for (const auto& [x, y] : {std::pair{-5.0, 3.0}, {1e4, 3.0}, {3.0, -1.0}, {3.0, 1e4}})
        CHECK((cells.at(x, y) == cells.at(0, 0)).all());
}
