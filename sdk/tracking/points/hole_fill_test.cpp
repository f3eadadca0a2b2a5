// A displacement is continued into holes of the control points' graph.
#include "sdk/tracking/points/hole_fill.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

using namespace defrec;
using Kind = HoleFill::Kind;

namespace {

constexpr float kReach = 40, kApart = 4;  // mm

// A row of control points, each connected with the next.
std::vector<defrec_edge> row_of(int32_t nodes) {
    std::vector<defrec_edge> edges;
    for (int32_t i = 0; i + 1 < nodes; ++i) edges.push_back({i, i + 1, 1.0f});
    return edges;
}
HoleFill fill_of(size_t nodes, const std::vector<defrec_edge>& edges) {
    std::vector<float> places;
    for (size_t i = 0; i < nodes; ++i)
        places.insert(places.end(), {kApart * static_cast<float>(i), 0, 0});
    return HoleFill(edges, places, kReach);
}

using Value = std::function<double(size_t node)>;

// value: along each axis, where it is known.
void fill(HoleFill& fill, const std::vector<Kind>& kinds, const Value& value) {
    fill.find(kinds);
    for (const uint32_t node : fill.known())
        fill.values().col(node).setConstant(static_cast<float>(value(node)));
    fill.fill();
}
HoleFill filled_row(const std::vector<Kind>& kinds, const Value& value) {
    HoleFill row = fill_of(kinds.size(), row_of(static_cast<int32_t>(kinds.size())));
    fill(row, kinds, value);
    return row;
}

// Known control points on both sides of some in a hole.
std::vector<Kind> row_with_hole(size_t nodes, size_t first, size_t last) {
    std::vector<Kind> kinds(nodes, HoleFill::kKnown);
    for (size_t i = first; i < last; ++i) kinds[i] = HoleFill::kHole;
    return kinds;
}

}  // namespace

TEST_CASE("a slope goes on into the hole: a valley is deeper inside than at its border") {
    const auto valley = [](size_t node) { return 0.1 * std::pow(double(node) - 5, 2) - 2; };
    const HoleFill row = filled_row(row_with_hole(11, 4, 7), valley);
    for (int i = 4; i < 7; ++i)
        CHECK(row.values()(2, i) == doctest::Approx(valley(static_cast<size_t>(i))).epsilon(0.1));
    CHECK(double{row.values()(2, 5)} < valley(3) - 0.2);
}

TEST_CASE("far from what is known nothing is continued") {
    const HoleFill row = filled_row(row_with_hole(60, 10, 50), [](size_t) { return 3.0; });
    CHECK(row.values()(0, 10) == doctest::Approx(3).epsilon(0.2));
    CHECK(row.values().col(30).norm() < 1e-3);
}

TEST_CASE("what is read is known, round the hole, and each once") {
    const HoleFill row = filled_row(row_with_hole(12, 5, 7), [](size_t) { return 1.0; });
    const std::vector<uint32_t> round = {3, 4, 7, 8};
    CHECK(std::is_permutation(row.known().begin(), row.known().end(), round.begin(), round.end()));
    std::vector<Kind> two_holes = row_with_hole(12, 5, 6);
    two_holes[7] = HoleFill::kHole;
    const HoleFill both = filled_row(two_holes, [](size_t) { return 1.0; });
    std::vector<uint32_t> known(both.known().begin(), both.known().end());
    std::sort(known.begin(), known.end());
    CHECK(std::adjacent_find(known.begin(), known.end()) == known.end());
    CHECK(both.values()(0, 5) == doctest::Approx(1).epsilon(0.1));
    CHECK(both.values()(0, 7) == doctest::Approx(1).epsilon(0.1));
}

TEST_CASE("a hole without a border has none, and nothing passes what is neither") {
    const HoleFill row =
        filled_row({HoleFill::kKnown, HoleFill::kNeither, HoleFill::kHole, HoleFill::kHole},
                   [](size_t) { return 7.0; });
    CHECK(row.known().empty());
    CHECK(row.values().isZero());
}

TEST_CASE("control points that nobody reads belong to a hole, and make none alone") {
    std::vector<Kind> kinds = row_with_hole(20, 4, 7);
    const HoleFill asked = filled_row(kinds, [](size_t node) { return double(node); });
    kinds[4] = kinds[6] = HoleFill::kUnread;
    kinds[14] = HoleFill::kUnread;
    const HoleFill row = filled_row(kinds, [](size_t node) { return double(node); });
    CHECK(std::equal(row.known().begin(), row.known().end(), asked.known().begin(),
                     asked.known().end()));
    CHECK(row.values().col(5) == asked.values().col(5));
    CHECK(row.values().col(14).isZero());
}

TEST_CASE("sides that are not connected tell nothing of each other") {
    std::vector<defrec_edge> edges = row_of(12);
    edges.erase(edges.begin() + 5);  // between 5 and 6, in the middle of the hole
    HoleFill row = fill_of(12, edges);
    fill(row, row_with_hole(12, 4, 8), [](size_t node) { return node < 6 ? 0.0 : 5.0; });
    CHECK(row.values().leftCols(6).isZero());
    CHECK(row.values()(0, 6) > 2.5);
}

TEST_CASE("of very many round a hole some are read, which tell the same") {
    constexpr int kSide = 60;  // a square of control points, all known but those inside a border
    std::vector<float> places;
    std::vector<defrec_edge> edges;
    std::vector<Kind> kinds;
    for (int32_t y = 0; y < kSide; ++y)
        for (int32_t x = 0; x < kSide; ++x) {
            const int32_t node = y * kSide + x;
            places.insert(places.end(), {float(x), float(y), 0});
            if (x > 0) edges.push_back({node - 1, node, 1});
            if (y > 0) edges.push_back({node - kSide, node, 1});
            const bool is_inside = x > 3 && y > 3 && x < kSide - 4 && y < kSide - 4;
            kinds.push_back(is_inside ? HoleFill::kHole : HoleFill::kKnown);
        }
    HoleFill square(edges, places, kReach);
    fill(square, kinds, [](size_t) { return 2.0; });
    CHECK(square.known().size() <= 96);
    CHECK(square.values()(1, 5 * kSide + kSide / 2) == doctest::Approx(2).epsilon(0.1));
}

TEST_CASE("the next frame begins anew") {
    HoleFill row = filled_row(row_with_hole(9, 3, 6), [](size_t) { return 4.0; });
    CHECK(row.values()(0, 4) == doctest::Approx(4).epsilon(0.1));
    fill(row, std::vector<Kind>(9, HoleFill::kKnown), [](size_t) { return 4.0; });
    CHECK(row.known().empty());
    CHECK(row.values().isZero());
}
