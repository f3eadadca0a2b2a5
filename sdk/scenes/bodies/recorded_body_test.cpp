// The recorded bodies: interpolation, and what the finite-element program's results must be.
#include "sdk/scenes/bodies/recorded_body.hpp"

#include <doctest/doctest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <string>

#include "sdk/scenes/bodies/loaded_layer.hpp"

namespace recorded = defrec::cli::recorded;
using defrec::cli::BodyLoad;
using defrec::cli::kBodyDepths;
using defrec::cli::LoadedLayer;
using defrec::cli::RecordedBody;
using defrec::cli::RecordedWords;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

Vector3d moved(const RecordedBody& body, double share, double s, double t, std::size_t layer) {
    return body.displacement({.share = share}, s, t, layer);
}

/// Where material lies at a share of the load, with the surface at z = 0.
Vector3d place(const RecordedBody& body, double share, double s, double t, std::size_t layer) {
    return Vector3d(s, t, kBodyDepths[layer]) + moved(body, share, s, t, layer);
}

/// Volume of a piece of material relative to rest: 4 x 4 mm, from layer to layer below.
double volume_ratio(const RecordedBody& body, double s, double t, std::size_t layer) {
    const auto at = [&](double ds, double dt, std::size_t l) {
        return place(body, 1, s + ds, t + dt, l);
    };
    Matrix3d gradient = Matrix3d::Zero();
    for (const std::size_t l : {layer, layer + 1}) {
        gradient.col(0) += (at(2, 0, l) - at(-2, 0, l)) / 8;
        gradient.col(1) += (at(0, 2, l) - at(0, -2, l)) / 8;
    }
    gradient.col(2) =
        (at(0, 0, layer + 1) - at(0, 0, layer)) / (kBodyDepths[layer + 1] - kBodyDepths[layer]);
    return gradient.determinant();
}

/// Degrees by which the line on the surface between two places along s has turned towards the
/// camera.
double turn_between(const RecordedBody& body, double share, double from, double to) {
    const Vector3d along = place(body, share, to, 0, 0) - place(body, share, from, 0, 0);
    return std::atan2(-along.z(), along.x()) * 180 / std::numbers::pi;
}

}  // namespace

TEST_CASE("a recorded body is its numbers at the nodes, smooth between and straight on beyond") {
    const RecordedWords words = recorded::organ_049;
    const RecordedBody body(words);
    const std::size_t columns = words[0], rows = words[1], layers = words[2], loads = words[3];
    REQUIRE(columns * rows * layers * loads * 6 == 4 * (words.size() - 9));
    const auto number = [&](std::size_t index) {
        const std::uint32_t word = words[9 + index / 2];
        return static_cast<std::int16_t>(index % 2 == 0 ? word & 0xFFFFu : word >> 16u);
    };
    // Load 7 of 10, layer 2, row 3, column 19.
    const std::size_t first = 3 * (((6 * layers + 2) * rows + 3) * columns + 19);
    const Vector3d expected = 0.002 * Vector3d(number(first), number(first + 1), number(first + 2));
    CHECK(expected.norm() > 5);
    CHECK((moved(body, 0.7, -55 + 5 * 19, -40 + 5 * 3, 2) - expected).norm() < 1e-6);
    CHECK(moved(body, 0, 40, 0, 0).isZero());

    // The slopes from both sides of a node of s, of t, of the load, and of the grid's edge.
    constexpr double kStep = 1e-5;
    const auto check_smooth = [&](const auto& at, double x) {
        const Vector3d before = (at(x) - at(x - kStep)) / kStep;
        const Vector3d after = (at(x + kStep) - at(x)) / kStep;
        CHECK((before - after).norm() < 1e-3 * (1e-3 + before.norm()));
    };
    check_smooth([&](double s) { return moved(body, 0.66, s, 7, 1); }, 20);
    check_smooth([&](double s) { return moved(body, 0.66, s, 7, 1); }, 55);
    check_smooth([&](double t) { return moved(body, 0.66, 33, t, 1); }, 15);
    check_smooth([&](double share) { return moved(body, share, 33, 7, 1); }, 0.6);
    const Vector3d outside = moved(body, 1, 75, 7, 0) - moved(body, 1, 65, 7, 0);
    CHECK((moved(body, 1, 65, 7, 0) - moved(body, 1, 55, 7, 0) - outside).norm() < 1e-9);
    CHECK(outside.norm() > 1);
}

TEST_CASE("lifted bodies are held at one side and turn at the other") {
    struct Case {
        RecordedWords words;
        double half_length;
        std::size_t layers;
    };
    for (const Case& c : {Case{recorded::organ_030, 55, 4}, Case{recorded::organ_049, 55, 4},
                          Case{recorded::retract_030, 65, 7}, Case{recorded::retract_049, 65, 7}}) {
        const RecordedBody body(c.words);
        REQUIRE(body.layers() == c.layers);
        for (std::size_t layer = 0; layer < c.layers; ++layer) {
            CHECK(moved(body, 1, -c.half_length, 10, layer).isZero());
            CHECK(moved(body, 1, -c.half_length + 5, -20, layer).isZero());
        }
        // What is lifted moves as a rigid whole, as it is told.
        const double edge = c.half_length;
        CHECK(turn_between(body, 1, edge - 5, edge) == doctest::Approx(40).epsilon(0.001));
        CHECK(turn_between(body, 0.5, edge - 5, edge) == doctest::Approx(20).epsilon(0.001));
        CHECK(turn_between(body, 1, -1, 1) > 10);
        CHECK(turn_between(body, 1, -1, 1) < 30);
        CHECK(moved(body, 1, edge, 0, 0).z() < -30);
        // Both halves across are the same, mirrored.
        const Vector3d one = moved(body, 1, 30, 12, 1), other = moved(body, 1, 30, -12, 1);
        CHECK((one - Vector3d(other.x(), -other.y(), other.z())).norm() < 0.01);
    }
}

TEST_CASE("nearly incompressible bodies keep their volume, the others do not") {
    const auto largest_change = [](RecordedWords words) {
        const RecordedBody body(words);
        double largest = 0;
        for (std::size_t layer = 1; layer + 1 < body.layers(); ++layer) {
            for (const double s : {-20.0, 0.0, 20.0}) {
                for (const double t : {-10.0, 5.0}) {
                    largest = std::max(largest, std::abs(volume_ratio(body, s, t, layer) - 1));
                }
            }
        }
        return largest;
    };
    CHECK(largest_change(recorded::organ_049) < 0.02);
    CHECK(largest_change(recorded::retract_049) < 0.02);
    CHECK(largest_change(recorded::retract_030) > 0.04);
}

TEST_CASE("away from its ball a pressed block is the layer that a formula describes") {
    struct Case {
        RecordedWords words;
        double poisson;
    };
    for (const Case& c :
         {Case{recorded::inclusion_030, 0.3}, Case{recorded::inclusion_049, 0.49}}) {
        CAPTURE(c.poisson);
        const RecordedBody body(c.words);
        const LoadedLayer layer({c.poisson, 50}, 8);
        // The smallest of the recorded loads, where large displacements matter least.
        constexpr double kShare = 0.125;
        const auto ratio = [&](double s, double t, std::size_t depth, double peak) {
            const Vector3d formula = layer.displacement({.press = peak}, s, t, depth);
            return (moved(body, kShare, s, t, depth) - formula).norm() / peak;
        };
        const double peak = moved(body, kShare, 0, 0, 0).z();
        CHECK(peak > 0.6);
        CHECK(peak < 1.2);
        for (const double s : {-4.0, -8.0, -16.0}) {
            for (std::size_t depth = 0; depth < kBodyDepths.size(); ++depth) {
                CAPTURE(s);
                CAPTURE(depth);
                CHECK(ratio(s, 4, depth, peak) < 0.06);
            }
        }
        // In the ball, tissue of the formula is strained, and the block's is not.
        const auto stretch = [&](const defrec::cli::ElasticBody& of, const BodyLoad& load) {
            return (of.displacement(load, 9, -4, 4) - of.displacement(load, 9, -4, 3)).z() / 10;
        };
        CHECK(std::abs(stretch(body, {.share = kShare})) <
              0.4 * std::abs(stretch(layer, {.press = peak})));
    }
}
