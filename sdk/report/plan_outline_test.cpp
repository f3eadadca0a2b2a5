// Outlines of a plan's parts, of a ball whose silhouette is known.
#include "sdk/report/plan_outline.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>

#include "sdk/report/plan_painter.hpp"

using namespace defrec::cli;

namespace {

constexpr int kWidth = 320, kHeight = 240;
constexpr double kFocal = 400, kDepth = 100, kRadius = 10, kErrorMm = 2;

void project(const float* xyz, std::size_t count, float* uv) {
    for (std::size_t i = 0; i < count; ++i) {
        const bool is_before = xyz[3 * i + 2] > 0;
        for (std::size_t k = 0; k < 2; ++k)
            uv[2 * i + k] =
                is_before
                    ? static_cast<float>(kFocal * double{xyz[3 * i + k]} / double{xyz[3 * i + 2]} +
                                         (k == 0 ? kWidth : kHeight) / 2.0)
                    : std::nanf("");
    }
}

// A ball about (x, 0, kDepth), its rings of vertices from pole to pole along y.
PlanEstimate ball(double x) {
    constexpr std::uint32_t kRings = 24, kAround = 48;
    auto model = std::make_shared<PlanModel>();
    PlanEstimate plan;
    for (std::uint32_t ring = 0; ring <= kRings; ++ring)
        for (std::uint32_t k = 0; k < kAround; ++k) {
            const double down = std::numbers::pi * ring / kRings,
                         around = 2 * std::numbers::pi * k / kAround;
            plan.vertices.push_back(
                static_cast<float>(x + kRadius * std::sin(down) * std::cos(around)));
            plan.vertices.push_back(static_cast<float>(-kRadius * std::cos(down)));
            plan.vertices.push_back(
                static_cast<float>(kDepth + kRadius * std::sin(down) * std::sin(around)));
            if (ring == kRings) continue;
            const std::uint32_t a = ring * kAround + k, b = ring * kAround + (k + 1) % kAround;
            for (const std::uint32_t corner : {a, b, a + kAround, b, b + kAround, a + kAround})
                model->triangles.push_back(corner);
        }
    model->parts.push_back({"tumour", 0, model->triangles.size() / 3});
    plan.status.assign(plan.vertices.size() / 3, VertexStatus::extrapolated);
    plan.expected_error_mm.assign(plan.status.size(), static_cast<float>(kErrorMm));
    plan.model = model;
    return plan;
}

std::vector<PlanOutline> outlines_of(const PlanEstimate& plan) {
    return plan_outlines(plan, project, kWidth, kHeight);
}

}  // namespace

TEST_CASE("a ball's outline is a circle, and as wide as its error a halo") {
    const auto outlines = outlines_of(ball(0));
    REQUIRE(outlines.size() == 1);
    CHECK(outlines[0].part == 0);
    CHECK(double{outlines[0].expected_error_mm} == doctest::Approx(kErrorMm));
    REQUIRE(outlines[0].contours.size() == 1);
    CHECK(outlines[0].contours[0].size() > 50);
    // A ball appears a little larger than its section.
    const double expected = kFocal * kRadius / std::sqrt(kDepth * kDepth - kRadius * kRadius);
    for (const OutlinePoint& point : outlines[0].contours[0]) {
        CHECK(std::hypot(point.u - kWidth / 2.0, point.v - kHeight / 2.0) ==
              doctest::Approx(expected).epsilon(0.04));
        CHECK(double{point.radius} == doctest::Approx(kFocal * kErrorMm / kDepth).epsilon(0.12));
        CHECK_FALSE(point.is_unknown);
        CHECK_FALSE(point.is_cut);
    }
}

TEST_CASE("what is unknown has no outline, and the edge against it is told from a silhouette") {
    PlanEstimate plan = ball(0);
    for (std::size_t i = 0; i < plan.status.size(); ++i)
        if (plan.vertices[3 * i + 1] > 0.1F) plan.status[i] = VertexStatus::unknown;
    const auto outlines = outlines_of(plan);
    REQUIRE(outlines.size() == 1);
    std::size_t unknown = 0, silhouette = 0;
    for (const OutlinePoint& point : outlines[0].contours[0]) {
        const double v = double{point.v} - kHeight / 2.0;
        CHECK(v < 4);  // the lower half is not there
        if (point.is_unknown) CHECK(v > -8);
        unknown += point.is_unknown;
        silhouette += !point.is_unknown && v < -8;
    }
    CHECK(unknown > 15);
    CHECK(silhouette > 20);

    plan.status.assign(plan.status.size(), VertexStatus::unknown);
    CHECK(outlines_of(plan).empty());
    plan.vertices.clear();
    plan.status.clear();
    CHECK(outlines_of(plan).empty());
    CHECK(outlines_of({}).empty());
}

TEST_CASE("the image's edge is no outline, and what lies behind the camera is left out") {
    const auto outlines = outlines_of(ball(40));  // its middle is on the right edge
    REQUIRE(outlines.size() == 1);
    std::size_t cut = 0;
    for (const OutlinePoint& point : outlines[0].contours[0]) {
        CHECK(point.is_cut == (point.u >= kWidth - 1.5F));
        cut += point.is_cut;
    }
    CHECK(cut > 10);
    PlanEstimate behind = ball(0);
    for (std::size_t i = 2; i < behind.vertices.size(); i += 3) behind.vertices[i] -= 300;
    CHECK(outlines_of(behind).empty());
}

TEST_CASE("the picture: edge, halo and fill of a part, a cross for a target, nothing when lost") {
    PlanEstimate plan = ball(0);
    PointEstimate target;
    target.status = VertexStatus::extrapolated;
    target.xyz = {20, 0, static_cast<float>(kDepth)};
    target.covariance = {1, 0, 0, 1, 0, 1};
    plan.targets.push_back(target);
    const cv::Mat empty(kHeight, kWidth, CV_8UC3, cv::Scalar(60, 60, 60));
    cv::Mat image = empty.clone();
    Labels labels;
    draw_plan(image, plan, project, labels);
    const auto strength = [&](int u, int v) {
        return cv::norm(image.at<cv::Vec3b>(v, u), empty.at<cv::Vec3b>(v, u), cv::NORM_INF);
    };
    const int middle = kHeight / 2, edge = kWidth / 2 - cvRound(kFocal * kRadius / kDepth);
    CHECK(strength(kWidth / 2, middle) > 5);                           // filled
    CHECK(strength(edge - 6, middle) > strength(kWidth / 2, middle));  // halo
    CHECK(strength(edge, middle) > strength(edge - 6, middle));        // edge
    CHECK(strength(edge - 15, middle) == 0);
    CHECK(strength(kWidth / 2 + cvRound(kFocal * 20 / kDepth), middle) > 60);  // cross

    plan.vertices.clear();
    plan.status.clear();
    plan.expected_error_mm.clear();
    plan.targets[0].status = VertexStatus::unknown;
    image = empty.clone();
    draw_plan(image, plan, project, labels);
    CHECK(cv::norm(image, empty, cv::NORM_INF) == 0);
}

TEST_CASE("many targets without names have no labels, those with names do") {
    PlanEstimate plan = ball(0);
    const auto labels_of = [&](int unnamed) {
        plan.targets.clear();
        for (int i = 0; i <= unnamed; ++i) {
            PointEstimate target;
            target.status = VertexStatus::extrapolated;
            target.xyz = {static_cast<float>(2 * i), 0, static_cast<float>(kDepth)};
            if (i == 0) target.name = "vessel";
            plan.targets.push_back(target);
        }
        cv::Mat image(kHeight, kWidth, CV_8UC3, cv::Scalar(60, 60, 60));
        Labels labels;
        draw_plan(image, plan, project, labels);
        return labels.size();
    };
    CHECK(labels_of(6) == 1 + 1 + 6);  // of the part, of the vessel, and of the others
    CHECK(labels_of(7) == 1 + 1);
    CHECK(label_text("target 10", 0.6) == "target 10 +/-0.6 mm");
}

TEST_CASE("labels are left out where there is no room, and stand below a mark at the top") {
    cv::Mat image(kHeight, kWidth, CV_8UC3, cv::Scalar(60, 60, 60));
    const cv::Mat empty = image.clone();
    const auto is_changed = [&](const cv::Rect& area) {
        return cv::norm(image(area), empty(area), cv::NORM_INF) > 0;
    };
    Labels labels;
    for (int i = 0; i < 16; ++i)
        labels.add(Labels::Rank::kTarget, std::to_string(i) + " 1.0 mm", 100.F + float(i % 4),
                   100.F + float(i / 4));
    labels.add(Labels::Rank::kPart, "tumour 9.0 mm", 200, 2);
    labels.add(Labels::Rank::kPoint, "outside", -20, 100);
    labels.draw(image, 0);
    CHECK(is_changed({200, 4, 100, 20}));
    CHECK_FALSE(is_changed({200, 0, 100, 4}));
    // Four places round the heap; the rest of it has none.
    CHECK(is_changed({100, 80, 100, 40}));
    CHECK_FALSE(is_changed({0, 30, kWidth, 50}));
    CHECK_FALSE(is_changed({0, 130, kWidth, 80}));
}
