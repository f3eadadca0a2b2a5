// The scenes whose tissue is sheets: pieces, organs in contact, folds and loops. Their formulas,
// and what is visible of them.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "sdk/scenes/film.hpp"

using defrec::cli::Film;
using defrec::cli::FrameState;
using defrec::cli::Lattice;
using defrec::cli::make_scene;
using defrec::cli::MeshFormula;
using defrec::cli::Scene;
using defrec::cli::SceneSetting;
using defrec::cli::Sheet;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

using Settings = std::vector<SceneSetting>;

constexpr int kWidth = 384, kHeight = 216;

Scene scene_of(const std::string& name, const Settings& settings = {}) {
    return make_scene(name, kWidth, kHeight, 60, 1, settings);
}

/// Calls use(a, b, c) with the corners of the triangles of a sheet, in the left camera.
template <class Use>
void each_triangle(const Sheet& sheet, const MeshFormula& at, const FrameState& state, Use&& use) {
    const Lattice& l = sheet.lattice;
    const auto place = [&](int i, int j) -> Vector3d {
        return state.camera.rotation *
               (at(l.first_s + i * l.spacing_s, l.first_t + j * l.spacing_t) - state.camera.centre);
    };
    std::vector<Vector3d> above, here;
    for (int j = 0; j < l.rows; ++j) {
        above = std::move(here);
        here.clear();
        for (int i = 0; i < l.columns; ++i) here.push_back(place(i, j));
        for (int i = 1; j > 0 && i < l.columns; ++i) {
            const bool is_hole = j > sheet.hole.first_row && j <= sheet.hole.last_row &&
                                 i > sheet.hole.first_column && i <= sheet.hole.last_column;
            if (is_hole) continue;
            use(above[i - 1], above[i], here[i]);
            use(above[i - 1], here[i], here[i - 1]);
        }
    }
}

/// How much of the way from the camera to the point is free (Moeller and Trumbore, 1997): 1 where
/// nothing is in front of it.
std::vector<double> free_way(const Scene& scene, const FrameState& state,
                             const std::vector<Vector3d>& points) {
    std::vector<double> ways(points.size(), 1.0);
    for (std::size_t k = 0; k < scene.sheets.size(); ++k) {
        each_triangle(scene.sheets[k], state.sheets[k], state,
                      [&](const Vector3d& a, const Vector3d& b, const Vector3d& c) {
                          const Vector3d ab = b - a, ac = c - a;
                          for (std::size_t i = 0; i < points.size(); ++i) {
                              const Vector3d p = points[i].cross(ac);
                              const double det = ab.dot(p);
                              if (det == 0) continue;
                              const double u = -a.dot(p) / det;
                              if (u < 0 || u > 1) continue;
                              const Vector3d q = (-a).cross(ab);
                              const double v = points[i].dot(q) / det;
                              if (v < 0 || u + v > 1) continue;
                              const double way = ac.dot(q) / det;
                              if (way > 0) ways[i] = std::min(ways[i], way);
                          }
                      });
    }
    return ways;
}

struct Sighting {
    int visible = 0, hidden = 0, wrong = 0;

    /// But for points at the edge of what hides them.
    bool is_right() const { return wrong <= 0.03 * (visible + hidden); }
};

/// What the film calls visible, against rays to each point, at a frame.
Sighting sighting(const std::string& name, int frame, const Settings& settings) {
    Film film(name, kWidth, kHeight, 60, 1, 2, settings);
    film.advance();
    film.advance(frame);
    const FrameState state = film.scene().at(frame);
    std::vector<Film::Truth> truths;
    std::vector<Vector3d> positions;
    for (std::size_t id = 0; id < film.points().size(); ++id) {
        truths.push_back(film.truth(id));
        positions.push_back(truths.back().position);
    }
    const std::vector<double> ways = free_way(film.scene(), state, positions);
    Sighting seen;
    for (std::size_t id = 0; id < truths.size(); ++id) {
        const Vector2d pixel = film.scene().rig.left.project(positions[id]);
        if (pixel.x() < -0.5 || pixel.y() < -0.5 || pixel.x() > kWidth - 0.5 ||
            pixel.y() > kHeight - 0.5) {
            CHECK_FALSE(truths[id].visible);
            continue;
        }
        const bool is_free = (1.0 - ways[id]) * positions[id].norm() < 0.4;  // mm
        ++(is_free ? seen.visible : seen.hidden);
        seen.wrong += is_free != truths[id].visible ? 1 : 0;
    }
    return seen;
}

/// Pixels of the left view in which no tissue is seen.
int holes(const std::string& name, int frame, const Settings& settings) {
    Film film(name, kWidth, kHeight, 60, 1, 2, settings);
    film.advance();
    film.advance(frame);
    const std::vector<float> surface = film.left_surface();
    int count = 0;
    for (std::size_t i = 0; i < surface.size(); i += 3) count += std::isnan(surface[i]) ? 1 : 0;
    return count;
}

}  // namespace

TEST_CASE("no scene of sheets shows a gap") {
    for (const int frame : {0, 11, 20, 29}) {
        CAPTURE(frame);
        CHECK(holes("flap", frame, {{"instrument", 0}}) == 0);
        CHECK(holes("shear", frame, {}) == 0);
        CHECK(holes("shear", frame, {{"curvature", 0.016}, {"bodies", 3}, {"step", 10}}) == 0);
        CHECK(holes("fold", frame, {}) == 0);
        CHECK(holes("loops", frame, {}) == 0);
        CHECK(holes("resection", frame, {{"instrument", 0}}) == 0);
    }
}

TEST_CASE("a point of a sheet is visible where a ray from the camera reaches it first") {
    SUBCASE("flap") {
        const Sighting seen = sighting("flap", 20, {{"instrument", 0}});
        CHECK(seen.hidden > 40);
        CHECK(seen.visible > 40);
        CHECK(seen.is_right());
    }
    SUBCASE("flap, half way") { CHECK(sighting("flap", 10, {{"instrument", 0}}).is_right()); }
    SUBCASE("flap, far over") {
        const Sighting seen = sighting("flap", 20, {{"instrument", 0}, {"angle", 150}});
        CHECK(seen.hidden > 40);
        CHECK(seen.is_right());
    }
    SUBCASE("resection") { CHECK(sighting("resection", 14, {{"instrument", 0}}).is_right()); }
    SUBCASE("gauze") {
        const Sighting seen = sighting("gauze", 20, {});
        CHECK(seen.hidden > 15);
        CHECK(seen.is_right());
    }
    SUBCASE("organs with a step") {
        const Sighting seen = sighting("shear", 24, {{"step", 6}, {"bodies", 3}});
        CHECK(seen.visible > 100);
        CHECK(seen.is_right());
    }
    SUBCASE("fold") {
        const Sighting seen = sighting("fold", 30, {});
        CHECK(seen.hidden > 20);
        CHECK(seen.visible > 60);
        CHECK(seen.is_right());
    }
    SUBCASE("loops") {
        const Sighting seen = sighting("loops", 28, {});
        CHECK(seen.hidden > 20);
        CHECK(seen.visible > 20);
        CHECK(seen.is_right());
    }
}

TEST_CASE("a flap hangs on its hinge, lies where it was before and after, and keeps its lengths") {
    const Scene scene = scene_of("flap");
    const auto outer = [&](const FrameState& f, double s, double t) { return f.sheets[0](s, t); };
    const auto upper = [&](const FrameState& f, double s, double t) { return f.sheets[1](s, t); };
    const double hinge = -14, end = 18;
    for (const double frame : {0.0, 3.0, 36.5, 39.0}) {
        const FrameState state = scene.at(frame);
        for (const double s : {hinge, 0.0, end}) {
            for (const double t : {-12.0, 1.0, 12.0}) {
                CHECK((upper(state, s, t) - outer(state, s, t)).norm() < 1e-9);
            }
        }
    }
    const FrameState rest = scene.at(0), lifted = scene.at(20);
    for (double t = -12; t <= 12; t += 3) {
        CHECK((upper(lifted, hinge, t) - outer(lifted, hinge, t)).norm() < 1e-9);
    }
    // Beyond the bend the piece turns as one.
    const auto direction = [&](const FrameState& f) {
        return Vector3d((upper(f, end, 0) - upper(f, 4, 0)).normalized());
    };
    CHECK(std::acos(direction(rest).dot(direction(lifted))) * 180 / M_PI ==
          doctest::Approx(105).epsilon(0.04));
    const auto length = [&](const FrameState& f, Vector2d from, Vector2d to) {
        double sum = 0;
        for (int i = 0; i < 400; ++i) {
            const Vector2d a = from + (to - from) * (i / 400.0),
                           b = from + (to - from) * ((i + 1) / 400.0);
            sum += (upper(f, b.x(), b.y()) - upper(f, a.x(), a.y())).norm();
        }
        return sum;
    };
    for (const double t : {-9.0, 0.0, 9.0}) {
        CHECK(length(lifted, {hinge, t}, {end, t}) ==
              doctest::Approx(length(rest, {hinge, t}, {end, t})).epsilon(0.03));
    }
    for (const double s : {hinge, 0.0, end}) {
        CHECK(length(lifted, {s, -12}, {s, 12}) ==
              doctest::Approx(length(rest, {s, -12}, {s, 12})).epsilon(0.03));
    }
}

TEST_CASE("a flap has an underside that lies within its edges, and a bed beneath it") {
    const Scene scene = scene_of("flap");
    for (const double frame : {0.0, 10.0, 20.0}) {
        const FrameState state = scene.at(frame);
        for (const double t : {-12.0, -5.0, 0.0, 12.0}) {
            for (const double s : {-14.0, -8.0, 3.0, 18.0}) {
                const double thick = (state.sheets[2](-s, t) - state.sheets[1](s, t)).norm();
                const bool is_edge = s == -14 || s == 18 || std::abs(t) == 12;
                CHECK(thick == doctest::Approx(is_edge ? 0 : 2).epsilon(1e-6));
                const double deep = state.sheets[3](s, t).z() - state.sheets[0](s, t).z();
                CHECK(deep == doctest::Approx(is_edge ? 0 : 2.4).epsilon(1e-6));
            }
        }
    }
}

TEST_CASE("organs in contact slide along their line and meet at it") {
    for (const double curvature : {0.0, 0.016}) {
        const Scene scene = scene_of("shear", {{"curvature", curvature}});
        const FrameState rest = scene.at(0), out = scene.at(24);
        CHECK((out.sheets[1](5, 1) - rest.sheets[1](5, 1)).norm() > 12);
        CHECK((out.sheets[1](5, 1) - rest.sheets[1](5, 1)).norm() < 17);
        CHECK((out.sheets[0](5, -1) - rest.sheets[0](5, -1)).norm() < 3);
        for (double s = -30; s <= 30; s += 7) {
            CHECK((out.sheets[1](s, 0) - out.sheets[0](s + 14, 0)).norm() < 1e-9);
        }
    }
}

TEST_CASE("the legs of a fold meet one plane, at the ends of the parameters' ranges too") {
    for (const double height : {11.0, 16.0}) {
        for (const double lean : {0.0, 54.0}) {
            const Scene scene = scene_of("fold", {{"height", height}, {"lean", lean}});
            for (double frame = 0; frame < 60; frame += 1.5) {
                const FrameState state = scene.at(frame);
                // Along s there is no step in place or direction, and lengths are kept but for
                // relief and beat.
                double shortest = 1, longest = 1, straightest = 1;
                Vector3d last = state.sheets[0](-60, 3), along(1, 0, 0);
                for (double s = -59.9; s < 60; s += 0.1) {
                    const Vector3d here = state.sheets[0](s, 3);
                    const Vector3d now = (here - last).normalized();
                    shortest = std::min(shortest, (here - last).norm() / 0.1);
                    longest = std::max(longest, (here - last).norm() / 0.1);
                    straightest = std::min(straightest, now.dot(along));
                    last = here;
                    along = now;
                }
                CHECK(shortest > 0.75);
                CHECK(longest < 1.25);
                CHECK(straightest > 0.99);
            }
        }
    }
}

TEST_CASE("loops touch, and roll on each other without slip") {
    const Scene scene = scene_of("loops", {{"squeeze", 0}});
    constexpr double kRadius = 11;
    const auto axis_of = [](const FrameState& f, std::size_t tube) -> Vector3d {
        return 0.5 * (f.sheets[tube](0, 0) + f.sheets[tube](0, M_PI * kRadius));
    };
    for (double frame = 6; frame <= 26; frame += 4) {
        const FrameState state = scene.at(frame), next = scene.at(frame + 1e-4);
        const Vector3d between = axis_of(state, 1) - axis_of(state, 0);
        CHECK(between.norm() == doctest::Approx(2 * kRadius));
        const Vector3d touch = axis_of(state, 0) + 0.5 * between;
        Vector3d velocity[2];
        for (const std::size_t tube : {0, 1}) {
            double nearest = 1e9, at = 0;
            for (double t = -M_PI * kRadius; t < M_PI * kRadius; t += 1e-3) {
                const double distance = (state.sheets[tube](0, t) - touch).norm();
                if (distance < nearest) {
                    nearest = distance;
                    at = t;
                }
            }
            CHECK(nearest < 1e-3);
            velocity[tube] = (next.sheets[tube](0, at) - state.sheets[tube](0, at)) / 1e-4;
        }
        CHECK(velocity[0].norm() > 0.05);
        CHECK((velocity[1] - velocity[0]).norm() < 0.01);
    }
}

TEST_CASE("tissue that turns or slides into the view gives points in a later frame") {
    for (const char* name : {"loops", "shear"}) {
        CAPTURE(name);
        Film film(name, kWidth, kHeight, 60, 1, 2);
        film.advance();
        const std::size_t first = film.points().size();
        film.advance(24);
        film.add_points();
        REQUIRE(film.points().size() > first + 10);
        for (std::size_t id = first; id < film.points().size(); ++id) {
            const Film::Truth truth = film.truth(id);
            CHECK(truth.visible);
            const Vector2d pixel = film.scene().rig.left.project(truth.position);
            CHECK((pixel - Vector2d(film.points()[id].u, film.points()[id].v)).norm() < 1e-4);
        }
    }
}
