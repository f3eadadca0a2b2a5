// Lattices of cells of several sizes: what they cover, fields on them, places in them.
#include "sdk/body/lattice.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>

#include "sdk/base/util/error.hpp"

using namespace defrec;
using Eigen::Vector3d;

namespace {

constexpr double kStep = 2.5;
constexpr double kRadius = 41;
const Vector3d kLow(-50, -44, 60), kHigh(48, 43, 140), kMiddle(0, 0, 100);

// A ball whose surface is seen at its lowest z.
Lattice::Request ball() {
    Lattice::Request request;
    request.step = kStep;
    request.low = kLow;
    request.high = kHigh;
    request.max_cells = 100000;
    request.stiffness = [](const Vector3d& centre, double edge) {
        return (centre - kMiddle).norm() < kRadius + 0.87 * edge ? 1.0 : 0.0;
    };
    request.distance = [](const Vector3d& place) {
        return (place - (kMiddle - Vector3d(0, 0, kRadius))).norm();
    };
    return request;
}

const Lattice& ball_lattice() {
    static const Lattice lattice(ball());
    return lattice;
}

// A field that is given at the free nodes, at a place.
double value_at(const Lattice& lattice, const Lattice::Place& place,
                const std::vector<double>& free) {
    const Lattice::Cell& cell = lattice.cells()[static_cast<size_t>(place.cell)];
    const std::array<double, 8> weights = place.weights();
    double value = 0;
    for (size_t k = 0; k < 8; ++k)
        for (const Lattice::Term& term : lattice.terms(static_cast<size_t>(cell.node[k])))
            value += weights[k] * term.weight * free[static_cast<size_t>(term.node)];
    return value;
}

// The i-th of many places all over the box.
Vector3d place_in_box(int i) {
    const auto share = [&](double step) { return std::fmod(0.5 + step * i, 1.0); };
    return kLow + (kHigh - kLow)
                      .cwiseProduct(
                          Vector3d(share(0.8191725134), share(0.6710436067), share(0.5497004779)));
}

}  // namespace

TEST_CASE("a lattice has cells of several sizes, small ones where the surface is seen") {
    const Lattice& lattice = ball_lattice();
    std::set<int32_t> sizes;
    for (const Lattice::Cell& cell : lattice.cells()) {
        sizes.insert(cell.size);
        const Vector3d low = lattice.position({static_cast<int32_t>(&cell - lattice.cells().data()),
                                               Vector3d::Zero()}),
                       centre = low + Vector3d::Constant(lattice.edge(cell) / 2);
        if (cell.size > 1) CHECK(ball().distance(centre) > lattice.edge(cell));
        if (ball().distance(centre) < kStep) CHECK(cell.size == 1);
        CHECK(cell.stiffness == 1);
    }
    CHECK(sizes.size() >= 3);
    CHECK(*sizes.begin() == 1);
    CHECK(lattice.free_nodes() < lattice.nodes().size());
    CHECK(lattice.step() == kStep);
}

TEST_CASE("cells cover the body, each place once, and find gives the cell that a place lies in") {
    const Lattice& lattice = ball_lattice();
    int inside = 0;
    for (int i = 0; i < 4000; ++i) {
        const Vector3d place = place_in_box(i);
        const Lattice::Place found = lattice.find(place);
        int32_t holds = 0, cell_that_holds = -1;
        for (size_t c = 0; c < lattice.cells().size(); ++c) {
            const Vector3d low = lattice.position({static_cast<int32_t>(c), Vector3d::Zero()});
            const double edge = lattice.edge(lattice.cells()[c]);
            if (((place - low).array() < 0).any() || ((place - low).array() >= edge).any())
                continue;
            ++holds;
            cell_that_holds = static_cast<int32_t>(c);
        }
        REQUIRE(holds <= 1);
        REQUIRE(found.cell == cell_that_holds);
        if ((place - kMiddle).norm() < kRadius) REQUIRE(found.cell >= 0);
        if (found.cell < 0) continue;
        ++inside;
        CHECK((found.at.array() >= 0).all());
        CHECK((found.at.array() <= 1).all());
        CHECK((lattice.position(found) - place).norm() < 1e-9);
    }
    CHECK(inside > 1000);
    CHECK(inside < 4000);
    for (const double far : {1e9, -1e9, 1e300, std::nan("")})
        for (int axis = 0; axis < 3; ++axis) {
            Vector3d place = kMiddle;
            place[axis] = far;
            CHECK(lattice.find(place).cell == -1);
        }
}

TEST_CASE("a place outside of the body has the nearest of it, within reach") {
    const Lattice& lattice = ball_lattice();
    for (int i = 0; i < 300; ++i) {
        const Vector3d place = kMiddle + 2.2 * (place_in_box(i) - kMiddle);
        const Lattice::Place found = lattice.find_near(place, 1000);
        REQUIRE(found.cell >= 0);
        const double distance = (lattice.position(found) - place).norm();
        if (lattice.find(place).cell >= 0) {
            CHECK(distance < 1e-9);
            continue;
        }
        CHECK((found.at.array() >= 0).all());
        CHECK((found.at.array() <= 1).all());
        CHECK(lattice.find_near(place, distance - 0.01).cell == -1);
        CHECK(lattice.find_near(place, distance + 0.01).cell == found.cell);
        // No corner is nearer.
        for (const Vector3d& node : lattice.nodes())
            if ((node - place).norm() < distance - 1e-9) FAIL_CHECK("a node is nearer");
    }
}

TEST_CASE("nodes that hang have sums of weight 1 of free nodes, which linear fields come out of") {
    const Lattice& lattice = ball_lattice();
    const auto field = [](const Vector3d& place) {
        return 3 + Vector3d(0.7, -1.3, 0.4).dot(place);
    };
    std::vector<double> free;
    for (size_t node = 0; node < lattice.free_nodes(); ++node) {
        const auto terms = lattice.terms(node);
        REQUIRE(terms.size() == 1);
        REQUIRE(static_cast<size_t>(terms[0].node) == node);
        REQUIRE(terms[0].weight == 1);
        free.push_back(field(lattice.nodes()[node]));
    }
    for (size_t node = lattice.free_nodes(); node < lattice.nodes().size(); ++node) {
        double weight = 0, value = 0;
        REQUIRE(lattice.terms(node).size() >= 2);
        for (const Lattice::Term& term : lattice.terms(node)) {
            REQUIRE(static_cast<size_t>(term.node) < lattice.free_nodes());
            CHECK(term.weight > 0);
            weight += term.weight;
            value += term.weight * free[static_cast<size_t>(term.node)];
        }
        CHECK(std::abs(weight - 1) < 1e-12);
        CHECK(std::abs(value - field(lattice.nodes()[node])) < 1e-9);
    }
    for (int i = 0; i < 4000; ++i) {
        const Lattice::Place found = lattice.find(place_in_box(i));
        if (found.cell >= 0)
            CHECK(std::abs(value_at(lattice, found, free) - field(place_in_box(i))) < 1e-9);
    }
}

TEST_CASE("fields are continuous where cells of different size meet") {
    const Lattice& lattice = ball_lattice();
    std::vector<double> free;
    for (size_t node = 0; node < lattice.free_nodes(); ++node)
        free.push_back(std::sin(12.9898 * static_cast<double>(node)));
    int meetings = 0;
    for (size_t c = 0; c < lattice.cells().size(); ++c)
        for (int face = 0; face < 6; ++face)
            for (const double u : {0.15, 0.45, 0.8}) {
                Lattice::Place here{static_cast<int32_t>(c), Vector3d(u, 0.3, 0.6)};
                here.at[face / 2] = face % 2;
                Vector3d beyond = lattice.position(here);
                beyond[face / 2] += (face % 2 != 0 ? 1 : -1) * 1e-7;
                const Lattice::Place there = lattice.find(beyond);
                if (there.cell < 0 || lattice.cells()[static_cast<size_t>(there.cell)].size ==
                                          lattice.cells()[c].size)
                    continue;
                ++meetings;
                CHECK(std::abs(value_at(lattice, here, free) - value_at(lattice, there, free)) <
                      1e-5);
            }
    CHECK(meetings > 100);
}

TEST_CASE("cells where the body is not are left out, and more than the most is refused") {
    Lattice::Request request = ball();
    const size_t needed = ball_lattice().cells().size();
    request.max_cells = needed;
    CHECK(Lattice(request).cells().size() == needed);
    request.max_cells = needed - 1;
    std::string words = "none";
    try {
        const Lattice lattice(request);
    } catch (const Error& error) {
        CHECK(error.status() == DEFREC_ERROR_UNSUPPORTED);
        words = error.what();
    }
    CHECK(words.find(std::to_string(needed - 1)) != std::string::npos);
    request = ball();
    request.stiffness = [](const Vector3d&, double) { return 0.0; };
    const Lattice none(request);
    CHECK(none.cells().empty());
    CHECK(none.nodes().empty());
    CHECK(none.find(kMiddle).cell == -1);
    CHECK(none.find_near(kMiddle, 1000).cell == -1);
}

TEST_CASE("the same request gives the same lattice") {
    const Lattice again(ball());
    const Lattice& lattice = ball_lattice();
    REQUIRE(again.cells().size() == lattice.cells().size());
    for (size_t c = 0; c < again.cells().size(); ++c) {
        CHECK(again.cells()[c].corner == lattice.cells()[c].corner);
        CHECK(again.cells()[c].node == lattice.cells()[c].node);
    }
    REQUIRE(again.nodes().size() == lattice.nodes().size());
    for (size_t node = 0; node < again.nodes().size(); ++node) {
        CHECK(again.nodes()[node] == lattice.nodes()[node]);
        const auto one = again.terms(node), other = lattice.terms(node);
        REQUIRE(one.size() == other.size());
        for (size_t t = 0; t < one.size(); ++t) {
            CHECK(one[t].node == other[t].node);
            CHECK(one[t].weight == other[t].weight);
        }
    }
}
