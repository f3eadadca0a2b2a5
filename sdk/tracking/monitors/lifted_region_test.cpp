// A flat surface a part of which is turned about a hinge: what a frame says of it is made up.
#include "sdk/tracking/monitors/lifted_region.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "sdk/template/cut.hpp"

using namespace defrec;

namespace {

constexpr int kColumns = 60, kRows = 44;
constexpr double kStep = 8, kDepth = 80, kFocal = 400, kMmPerPx = kDepth / kFocal;
// The flap, px; its hinge is at the left.
constexpr double kLeft = 160, kRight = 320, kTop = 96, kBottom = 256;

struct Lifting {
    double angle = 0.4;    // rad
    double towards = 1;    // the camera; -1: away
    double hinge = kLeft;  // px
    bool slides = false;   // to the right instead, by as much as its end would rise
    double unseen = 8;     // px on either side of its sides that do not show the template
};

// An instrument that reaches into the image from the right, and lies nearer. Beside it tissue shows
// the template and has the instrument's depth.
struct Instrument {
    double tip = 200, upper = 150, lower = 214, fattened = 8;  // px
    double nearer = 5;                                         // mm
};

struct Surface {
    TemplateData data;
    std::vector<defrec_surface_sample> samples;
    std::vector<uint8_t> is_confirmed;

    explicit Surface(const Lifting& lifting) {
        add_vertices([&](double u, double v) { add_vertex(u, v, lifting); });
    }
    explicit Surface(const Instrument& instrument) {
        add_vertices([&](double u, double v) { add_vertex(u, v, instrument); });
    }

    std::optional<LiftedRegion> find() {
        FrameOutput output;
        output.samples = samples;
        return find_lifted_region(data, output, is_confirmed);
    }
    bool parts(const LiftedRegion& region, const ViewPixel& from, const ViewPixel& to) const {
        return is_parted(region.tears, 0, from, to);
    }

  private:
    template <class Add>  // add(u, v)
    void add_vertices(const Add& add) {
        data.width = static_cast<uint32_t>(kColumns * kStep);
        data.height = static_cast<uint32_t>(kRows * kStep);
        data.camera = {kFocal, kFocal, data.width / 2.0, data.height / 2.0, 5, 0};
        data.node_grid.spacing_u = data.node_grid.spacing_v = 4 * kStep;
        data.grid.columns = kColumns;
        data.grid.rows = kRows;
        data.grid.spacing = kStep;
        for (int y = 0; y < kRows; ++y)
            for (int x = 0; x < kColumns; ++x) add(x * kStep, y * kStep);
    }
    defrec_surface_sample add_vertex_at(double u, double v) {
        data.grid.vertex.push_back(static_cast<int32_t>(data.vertices.size()));
        data.check_of_vertex.push_back(0);
        defrec_surface_point point{};
        point.position[0] = static_cast<float>((u - data.camera.cx) * kMmPerPx);
        point.position[1] = static_cast<float>((v - data.camera.cy) * kMmPerPx);
        point.position[2] = static_cast<float>(kDepth);
        data.vertices.push_back(point);
        defrec_surface_sample sample{};
        std::copy_n(point.position, 3, sample.position);
        sample.observation = DEFREC_OBSERVED;
        return sample;
    }
    void add_vertex(double u, double v, const Instrument& instrument) {
        defrec_surface_sample sample = add_vertex_at(u, v);
        const double inside =
            std::min({u - instrument.tip, v - instrument.upper, instrument.lower - v});
        if (inside > -instrument.fattened) {
            sample.residual = static_cast<float>(-instrument.nearer);
            sample.observation = DEFREC_OCCLUDED;
        }
        samples.push_back(sample);
        is_confirmed.push_back(inside > 0 ? 0 : 1);
    }
    void add_vertex(double u, double v, const Lifting& lifting) {
        defrec_surface_sample sample = add_vertex_at(u, v);
        const bool is_of_flap = u > kLeft && u < kRight && v > kTop && v < kBottom;
        const double length = (u - lifting.hinge) * kMmPerPx;
        if (is_of_flap && lifting.slides) {
            sample.position[0] +=
                static_cast<float>((kRight - kLeft) * kMmPerPx * std::sin(lifting.angle));
        } else if (is_of_flap && length > 0) {
            sample.position[0] -= static_cast<float>(length * (1 - std::cos(lifting.angle)));
            sample.position[2] -=
                static_cast<float>(lifting.towards * length * std::sin(lifting.angle));
        }
        samples.push_back(sample);
        const double to_side =
            std::min({std::abs(v - kTop), std::abs(v - kBottom), std::abs(u - kRight)});
        const bool beside = u > kLeft && u < kRight + lifting.unseen && v > kTop - lifting.unseen &&
                            v < kBottom + lifting.unseen;
        is_confirmed.push_back(beside && to_side <= lifting.unseen ? 0 : 1);
    }
};

}  // namespace

TEST_CASE("a flap is torn off along its sides, and not at its hinge") {
    Surface surface(Lifting{});
    const std::optional<LiftedRegion> region = surface.find();
    REQUIRE(region);
    const double middle = (kTop + kBottom) / 2;
    CHECK(surface.parts(*region, {kRight - 40, middle}, {kRight + 40, middle}));
    CHECK(surface.parts(*region, {kRight - 40, kTop + 40}, {kRight - 40, kTop - 40}));
    CHECK(surface.parts(*region, {kRight - 40, kBottom - 40}, {kRight - 40, kBottom + 40}));
    CHECK(!surface.parts(*region, {kLeft + 80, middle}, {kLeft - 40, middle}));
    CHECK(!surface.parts(*region, {kRight - 80, kTop + 40}, {kRight - 20, kBottom - 40}));
    for (const CutLine& tear : region->tears)
        for (const auto& [u, v] : tear.pixels) {
            CHECK(u > kLeft - 33);
            CHECK(u < kRight + 17);
        }
    // Its motion is that of the flap.
    const auto motion = fit_pairs(region->pairs);
    const Vec3<double> end = apply(motion, Vec3<double>{16, 0, kDepth});
    CHECK(end.z == doctest::Approx(kDepth - 32 * std::sin(0.4)).epsilon(0.01));
}

TEST_CASE("what is known to be parted is not parted again") {
    Surface surface(Lifting{});
    std::optional<LiftedRegion> region = surface.find();
    REQUIRE(region);
    surface.data.node_grid.cuts = region->tears;
    CHECK(!surface.find());
}

TEST_CASE("tissue that bends, is pressed down or slides is not torn off") {
    CHECK(!Surface(Lifting{.angle = 0.02}).find());
    CHECK(!Surface(Lifting{.towards = -1}).find());
    CHECK(!Surface(Lifting{.slides = true}).find());
}

TEST_CASE("tissue that an instrument covers is not torn off") {
    CHECK(!Surface(Instrument{}).find());
}

TEST_CASE("only a surface that is drawn out is looked at") {
    Surface surface(Lifting{});
    surface.data.nodes = {0, 0, 80, 5, 0, 80};
    surface.data.edges = {{0, 1, 1}};
    std::vector<Vec3<double>> nodes{{0, 0, 80}, {5, 0, 80}};
    CHECK(!may_be_torn(surface.data, nodes));
    nodes[1] = {5, 0, 76};
    CHECK(may_be_torn(surface.data, nodes));
}
