#include "sdk/tracking/map/piece_search.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <vector>

#include "sdk/template/nearest_nodes.hpp"

using namespace defrec;

namespace {

using Point = Vec3<double>;

// Motion of the second piece: turned by 0.4 rad about the ray, 12 mm aside and 5 mm nearer.
Point moved(const Point& p) {
    const double c = std::cos(0.4), s = std::sin(0.4);
    return {c * p.x - s * p.y + 12, s * p.x + c * p.y, p.z - 5};
}

// Two pieces with 80 landmarks each; so many of the second's are matched right, the others of it at
// random, those of the first in their place.
struct Scene {
    TemplateData data;
    std::vector<defrec_match> matches;
    std::vector<defrec_motion> motions;

    explicit Scene(int right, double bend = 0) {
        std::mt19937 random(7);
        std::uniform_real_distribution<double> aside(-20, 20), depth(70, 90);
        for (int piece = 0; piece < 2; ++piece) {
            for (int node = 0; node < 9; ++node) {
                data.nodes.insert(data.nodes.end(), {static_cast<float>(12 * (node % 3) - 12),
                                                     static_cast<float>(12 * (node / 3) - 12), 80});
                data.node_piece.push_back(static_cast<uint8_t>(piece));
            }
            for (int i = 0; i < 80; ++i) {
                const Point rest{aside(random), aside(random), 80};
                defrec_landmark landmark{};
                store3(rest, landmark.position);
                defrec_surface_point point{};
                for (int32_t& node : point.node) node = 9 * piece;
                data.landmarks.push_back(landmark);
                data.landmark_points.push_back(point);
                const Point elsewhere{aside(random), aside(random), depth(random)};
                Point live = piece == 0 ? rest : i < right ? moved(rest) : elsewhere;
                if (piece == 1 && i < right) live.z += bend * rest.x * rest.x / 400;
                defrec_match match{};
                match.feature = i;
                store3(live, match.position);
                matches.push_back(match);
            }
        }
        motions.assign(18, DualQuaternion<float>::identity().store());
    }
    Point node_now(size_t node) const { return node_position(data.nodes, motions, node); }
};

double distance(const Point& a, const Point& b) { return std::sqrt(dot(a - b, a - b)); }

}  // namespace

TEST_CASE("a piece is found where a quarter of its matches say that it went, and no other moves") {
    Scene scene(20);
    REQUIRE(search_piece(scene.data, 1, scene.matches, scene.motions));
    for (size_t node = 0; node < 9; ++node) {
        const Point rest = load3<double>(&scene.data.nodes[3 * node]);
        CHECK(distance(scene.node_now(node), rest) < 1e-3);
        CHECK(distance(scene.node_now(9 + node), moved(rest)) < 1);
    }
}

TEST_CASE("a piece that has bent as well is found as it lies") {
    Scene scene(60, 2);
    REQUIRE(search_piece(scene.data, 1, scene.matches, scene.motions));
    for (size_t node = 9; node < 18; ++node) {
        const Point rest = load3<double>(&scene.data.nodes[3 * node]);
        Point expected = moved(rest);
        expected.z += 2 * rest.x * rest.x / 400;
        CHECK(distance(scene.node_now(node), expected) < 0.8);
    }
}

TEST_CASE("matches at random find no piece, nor do a few") {
    for (const int right : {0, 8}) {
        CAPTURE(right);
        Scene scene(right);
        CHECK(!search_piece(scene.data, 1, scene.matches, scene.motions));
        for (size_t node = 0; node < 18; ++node)
            CHECK(distance(scene.node_now(node), load3<double>(&scene.data.nodes[3 * node])) <
                  1e-6);
    }
    Scene scene(80);
    for (defrec_match& match : scene.matches) match.position[2] = 0;  // depth unknown
    CHECK(!search_piece(scene.data, 1, scene.matches, scene.motions));
}
