// A displacement is continued into holes of the control points' graph.
#include "sdk/tracking/points/hole_fill.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <vector>

using namespace defrec;
using Kind = HoleFill::Kind;

namespace {

// A row of control points, each connected with the next.
std::vector<defrec_edge> row_of(int32_t nodes) {
    std::vector<defrec_edge> edges;
    for (int32_t i = 0; i + 1 < nodes; ++i) edges.push_back({i, i + 1, 1.0f});
    return edges;
}

HoleFill filled(const std::vector<defrec_edge>& edges, const std::vector<Kind>& kinds,
                const Eigen::Matrix3Xd& values) {
    HoleFill fill;
    fill.find(edges, kinds);
    for (const uint32_t node : fill.border()) fill.values().col(node) = values.col(node);
    fill.fill();
    return fill;
}

Eigen::Matrix3Xd constant(int nodes, double value) {
    return Eigen::Matrix3Xd::Constant(3, nodes, value);
}

}  // namespace

TEST_CASE("between two borders the displacement passes from one to the other") {
    const std::vector<Kind> kinds = {HoleFill::kKnown, HoleFill::kKnown, HoleFill::kHole,
                                     HoleFill::kHole,  HoleFill::kHole,  HoleFill::kKnown};
    Eigen::Matrix3Xd values = constant(6, 0);
    values.col(0).setConstant(100);  // not on the border
    values.col(1) = Eigen::Vector3d(1, 2, 3);
    values.col(5) = Eigen::Vector3d(5, 2, -1);
    const HoleFill fill = filled(row_of(6), kinds, values);
    const std::vector<uint32_t> ends = {1, 5};
    CHECK(
        std::is_permutation(fill.border().begin(), fill.border().end(), ends.begin(), ends.end()));
    for (int i = 2; i < 5; ++i) {
        CHECK(fill.values()(0, i) == doctest::Approx(i).epsilon(0.01));
        CHECK(fill.values()(1, i) == doctest::Approx(2).epsilon(0.01));
        CHECK(fill.values()(2, i) == doctest::Approx(4 - i).epsilon(0.01));
    }
}

TEST_CASE("a hole without a border has none, and nothing passes what is neither") {
    const std::vector<Kind> kinds = {HoleFill::kKnown, HoleFill::kNeither, HoleFill::kHole,
                                     HoleFill::kHole};
    const HoleFill fill = filled(row_of(4), kinds, constant(4, 7));
    CHECK(fill.border().empty());
    CHECK(fill.values().col(2).norm() == 0);
    CHECK(fill.values().col(3).norm() == 0);
}

TEST_CASE("a border that is constant fills its hole with the same, once more in the next frame") {
    HoleFill fill = filled(
        row_of(5),
        {HoleFill::kKnown, HoleFill::kHole, HoleFill::kHole, HoleFill::kHole, HoleFill::kKnown},
        constant(5, 4));
    CHECK((fill.values().array() - 4).abs().maxCoeff() < 0.1);
    const std::vector<Kind> next(5, HoleFill::kKnown);
    fill.find(row_of(5), next);
    CHECK(fill.border().empty());
}
