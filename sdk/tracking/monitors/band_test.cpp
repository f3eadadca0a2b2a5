#include "sdk/tracking/monitors/band.hpp"

#include <doctest/doctest.h>

#include <algorithm>

using namespace defrec;

TEST_CASE("a band that is larger than a square is divided into squares, and none of it is lost") {
    Band band;
    band.piece = 2;
    for (int y = 3; y < 14; ++y)
        for (int x = 0; x < 4; ++x) band.cells.emplace_back(x, y);
    CHECK(in_squares(band, 7).size() == 1);  // 44 cells
    const std::vector<Band> squares = in_squares(band, 5);
    REQUIRE(squares.size() == 3);
    size_t cells = 0;
    for (const Band& square : squares) {
        CHECK(square.piece == 2);
        cells += square.cells.size();
        const auto [low, high] =
            std::minmax_element(square.cells.begin(), square.cells.end(),
                                [](const Cell& a, const Cell& b) { return a.y() < b.y(); });
        CHECK(high->y() - low->y() < 5);
    }
    CHECK(cells == band.cells.size());
}

TEST_CASE("a line goes on as its last part runs, at either end") {
    std::vector<Cell> line;
    for (int i = 0; i < 8; ++i) line.emplace_back(i, std::max(0, i - 3));  // straight, then turned
    const auto [begin, end] = directions_at_ends(line, 3);
    CHECK((begin - Cell(-1, 0)).norm() < 1e-9);
    CHECK((end - Cell(1, 1).normalized()).norm() < 1e-9);
    const auto [back, ahead] = directions_at_ends(line, 100);
    CHECK((back + ahead).norm() < 1e-9);
}
