// Checks on a grid of control points, of which those of a region fail: what they say is made up.
#include "sdk/tracking/evidence/photometric_evidence.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>

#include "sdk/tracking/decisions/confidence.hpp"
#include "sdk/tracking/decisions/template_changes.hpp"

using namespace defrec;
using decisions::Confidence;

namespace {

constexpr int kSide = 24;  // control points, each with a check and a vertex of its own

struct Surface {
    TemplateData data;
    std::vector<defrec_patch_observation> checks{size_t{kSide} * kSide};
    std::vector<defrec_patch_prediction> predictions{size_t{kSide} * kSide};
    std::vector<defrec_surface_sample> samples{size_t{kSide} * kSide};
    PhotometricEvidence evidence;

    Surface() {
        data.nodes.resize(size_t{3} * kSide * kSide);
        data.node_grid.columns = data.node_grid.rows = kSide;
        for (int32_t i = 0; i < kSide * kSide; ++i) {
            data.node_grid.node.push_back(i);
            defrec_surface_point vertex{};
            defrec_patch check{};
            for (int k = 0; k < DEFREC_BLEND_NODES; ++k) vertex.node[k] = check.node[k] = i;
            vertex.weight[0] = check.weight[0] = 1;
            data.vertices.push_back(vertex);
            data.checks.push_back(check);
            data.check_of_vertex.push_back(i);
        }
        for (defrec_patch_observation& check : checks) fit(check, 4000);
        for (defrec_patch_prediction& prediction : predictions) prediction.valid = 1;
        for (defrec_surface_sample& sample : samples) sample.position[2] = 80;
        data.camera.fx = data.camera.fy = 500;
        data.camera.baseline_mm = 4;
        evidence.make_room(data);
    }
    static void fit(defrec_patch_observation& check, int32_t score) {
        check.valid = 1;
        check.score = score;
        check.information[0] = check.information[2] = 1;
    }
    // Checks less than so many control points from the middle fail, but for the middle's own.
    void fail_round_middle(int distance) {
        for (int y = 0; y < kSide; ++y)
            for (int x = 0; x < kSide; ++x)
                if (std::max(std::abs(x - kSide / 2), std::abs(y - kSide / 2)) < distance)
                    checks[static_cast<size_t>(y * kSide + x)] = {};
    }
    static constexpr size_t kMiddle = size_t{kSide / 2} * kSide + kSide / 2;
    bool confirms_middle(int32_t score) {
        fit(checks[kMiddle], score);
        return confirms_middle();
    }
    bool confirms_middle() {
        FrameOutput output;
        output.checks = checks;
        output.check_predictions = predictions;
        output.samples = samples;
        spread_checks(data, CheckedVertices(data), output, evidence);
        measure_photometric(data, output, 0, data.vertices.size(), evidence);
        return evidence.is_confirmed[kMiddle] != 0;
    }
};

}  // namespace

TEST_CASE("a check is evidence from the least ZNCC on where those round it fit") {
    Surface surface;
    CHECK(surface.confirms_middle(Confidence::kMinZncc));
    CHECK(!surface.confirms_middle(Confidence::kMinZncc - 1));
}

TEST_CASE("where most of a region does not fit, a check must fit best") {
    Surface surface;
    surface.fail_round_middle(Confidence::kRegionReach + 1);
    CHECK(!surface.confirms_middle(Confidence::kMinZnccAlone - 1));
    CHECK(surface.confirms_middle(Confidence::kMinZnccAlone));
}

TEST_CASE("what is required rises as fewer checks of the region fit") {
    // 49 of 121 fail: a share of 0.6 fits, 0.35 is reached with 81.
    Surface few, more;
    few.fail_round_middle(4);
    CHECK(few.confirms_middle(Confidence::kMinZncc + 200));
    more.fail_round_middle(5);
    CHECK(!more.confirms_middle(Confidence::kMinZncc + 800));
    CHECK(more.confirms_middle(Confidence::kMinZnccAlone));
}

TEST_CASE("where most of a region fails a check must have been located well") {
    const auto confirms = [](int failing, float information) {
        Surface surface;
        surface.fail_round_middle(failing);
        Surface::fit(surface.checks[Surface::kMiddle], Confidence::kMinZnccAlone);
        surface.checks[Surface::kMiddle].information[2] = information;
        return surface.confirms_middle();
    };
    CHECK(confirms(4, Confidence::kMinInformation / 2));
    CHECK(confirms(5, Confidence::kMinInformation));
    CHECK_FALSE(confirms(5, Confidence::kMinInformation / 2));
}

TEST_CASE("a check that was found elsewhere must fit better, the farther off") {
    Surface surface;
    const auto confirms_at = [&](double px, int32_t score) {
        Surface::fit(surface.checks[Surface::kMiddle], score);
        surface.checks[Surface::kMiddle].u = static_cast<int32_t>(256 * px);
        return surface.confirms_middle();
    };
    const auto needed = static_cast<int32_t>(Confidence::kMinZncc + 9 * Confidence::kZnccPerPx2);
    CHECK(confirms_at(0, Confidence::kMinZncc));
    CHECK_FALSE(confirms_at(3, Confidence::kMinZncc));
    CHECK_FALSE(confirms_at(3, needed - 1));
    CHECK(confirms_at(3, needed));
    CHECK(surface.evidence.check_px2[Surface::kMiddle] == 9);
}

TEST_CASE("a check that is compared where it is predicted confirms, and locates nothing") {
    Surface surface;
    defrec_patch_observation& middle = surface.checks[Surface::kMiddle];
    const auto keep = [&](int32_t score) {
        Surface::fit(middle, score);
        middle.information[0] = middle.information[2] = 0;
        return surface.confirms_middle();
    };
    CHECK_FALSE(keep(Confidence::kMinZnccKept - 1));
    CHECK(keep(Confidence::kMinZnccKept));
    CHECK(surface.evidence.check_px2[Surface::kMiddle] > 4);
    CHECK(surface.evidence.is_located[Surface::kMiddle] == 0);
    CHECK(surface.confirms_middle(Confidence::kMinZncc));
    CHECK(surface.evidence.is_located[Surface::kMiddle] == 1);
}

TEST_CASE("checks that fail where depth agrees or lies behind are refuted, beyond chance") {
    Surface surface;
    surface.fail_round_middle(3);
    surface.checks[Surface::kMiddle] = {};
    CHECK_FALSE(surface.confirms_middle());
    CHECK(surface.evidence.vertices_refuted == 25);
    CHECK(surface.evidence.refuted[Surface::kMiddle] == 1 - Confidence::kRefutedByChance);
    CHECK(surface.evidence.refuted[0] == 0);
    for (defrec_surface_sample& sample : surface.samples) sample.observation = DEFREC_INCONSISTENT;
    surface.confirms_middle();
    CHECK(surface.evidence.vertices_refuted == 25);
}

TEST_CASE("a check that fits and was not located is not refuted, wherever depth lies behind") {
    Surface surface;
    defrec_patch_observation& middle = surface.checks[Surface::kMiddle];
    Surface::fit(middle, Confidence::kMinZnccKept);
    middle.information[0] = middle.information[2] = 0;
    for (const uint32_t observation : {DEFREC_OBSERVED, DEFREC_INCONSISTENT})
        for (const float residual : {0.0f, -20.0f}) {
            surface.samples[Surface::kMiddle].observation = observation;
            surface.samples[Surface::kMiddle].residual = residual;
            CHECK(surface.confirms_middle());
            CHECK(surface.evidence.vertices_refuted == 0);
        }
}

TEST_CASE("nothing is refuted where something lies in front, or no check is expected") {
    Surface surface;
    surface.fail_round_middle(3);
    for (const uint32_t hidden : {DEFREC_OCCLUDED, DEFREC_OUTSIDE, DEFREC_NO_DEPTH}) {
        for (defrec_surface_sample& sample : surface.samples) sample.observation = hidden;
        surface.confirms_middle();
        CHECK(surface.evidence.vertices_refuted == 0);
    }
    for (defrec_surface_sample& sample : surface.samples) sample.observation = DEFREC_OBSERVED;
    for (defrec_patch_prediction& prediction : surface.predictions) prediction.valid = 0;
    surface.confirms_middle();
    CHECK(surface.evidence.vertices_refuted == 0);
}

TEST_CASE("a check that is found where depth is another is refuted") {
    Surface surface;
    const float per_px = depth_per_px(surface.data.camera, 80.0f);
    const auto refuted_at = [&](float px, uint32_t observation) {
        surface.samples[Surface::kMiddle].observation = observation;
        surface.samples[Surface::kMiddle].residual = px * per_px;
        surface.confirms_middle();
        return surface.evidence.vertices_refuted;
    };
    CHECK(refuted_at(1.1f * decisions::Departure::kMinPx, DEFREC_OCCLUDED) == 1);
    CHECK(refuted_at(-1.1f * decisions::Departure::kMinPx, DEFREC_INCONSISTENT) == 1);
    CHECK(refuted_at(0.9f * decisions::Departure::kMinPx, DEFREC_OCCLUDED) == 0);
    CHECK(refuted_at(0.9f * decisions::Departure::kMinPx, DEFREC_INCONSISTENT) == 0);
    CHECK(refuted_at(0, DEFREC_OBSERVED) == 0);
}
