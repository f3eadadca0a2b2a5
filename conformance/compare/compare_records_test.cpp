// What the comparisons must never take for near enough.
#include "conformance/compare/compare_records.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "conformance/worker/failure.hpp"

using namespace defrec::conformance;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(),
                kInfinity = std::numeric_limits<float>::infinity();

template <class... T>
std::vector<Bytes> outputs(const T&... records) {
    const auto bytes = [](const auto& record) {
        const auto* begin = reinterpret_cast<const std::byte*>(&record);
        return Bytes(begin, begin + sizeof record);
    };
    return {bytes(records)...};
}

template <class Params>
StageJob job_of(uint32_t stage, Params params) {
    params.struct_size = sizeof params;
    return {stage, &params};
}

// Whether the quantity is within the suite's tolerance; false, too, where the comparison refuses
// the records outright.
bool near_enough(SpreadOf compare, const StageJob& job, const std::vector<Bytes>& expected,
                 const std::vector<Bytes>& found, const std::string& quantity) {
    Spread spread;
    try {
        compare(job, expected, found, spread);
    } catch (const CaseFailure&) {
        return false;
    }
    return spread[quantity].maximum() <= Tolerances::of_suite().at(quantity).maximum;
}

}  // namespace

TEST_CASE("align: a prediction that is no number in int32 is far from any") {
    defrec_align_params params{};
    params.width = 640;
    params.height = 480;
    params.patches = params.nodes = params.views = 1;
    params.camera = {300, 300, 320, 240, 4, 0};
    const StageJob job = job_of(DEFREC_STAGE_ALIGN, params);
    const defrec_patch_observation none{};
    const auto near_to = [&](const defrec_patch_prediction& a, const defrec_patch_prediction& b) {
        return near_enough(align_spread, job, outputs(none, a), outputs(none, b),
                           "align.prediction");
    };
    const defrec_patch_prediction expected{0, 40000, {65536, 0, 0, 65536}, 1, 0};
    defrec_patch_prediction found = expected;
    CHECK(near_to(expected, found));
    found.u = 1;
    CHECK(near_to(expected, found));
    for (const int32_t wrong : {2, INT32_MIN, INT32_MAX}) {
        found.u = wrong;
        CHECK(!near_to(expected, found));
    }
    found = expected;
    found.valid = 7;
    CHECK(!near_to(expected, found));
}

TEST_CASE(
    "ransac: beside the weight below which it becomes 0, it is that weight or 0 and nothing else") {
    const StageJob job = job_of(DEFREC_STAGE_RANSAC, defrec_ransac_params{});
    const defrec_ransac_summary summary{};
    const auto near_to = [&](float expected, float found) {
        defrec_match a{}, b{};
        a.weight = expected;
        b.weight = found;
        return near_enough(ransac_weight_spread, job, outputs(a, summary), outputs(b, summary),
                           "ransac.weight");
    };
    CHECK(near_to(0.80005f, 0));
    CHECK(near_to(0, 0.80005f));
    CHECK(near_to(0.9f, 0.90005f));
    CHECK(!near_to(0.9f, 0));
    CHECK(!near_to(0, 0.9f));
    for (const float wrong : {kNan, -5.0f, -kInfinity}) {
        CHECK(!near_to(0.80005f, wrong));
        CHECK(!near_to(0, wrong));
    }
}

TEST_CASE("warp: a point at a border may fall on either side of it, but not anywhere") {
    defrec_warp_params params{};
    params.camera = {100, 100, 50.5f, 40, 4, 0};
    params.width = 100;
    params.height = 80;
    params.points = params.nodes = 1;
    params.tolerance_mm = 2;
    const StageJob job = job_of(DEFREC_STAGE_WARP, params);
    const defrec_surface_sample expected{
        {0, 0, 80}, {0, 0, -1}, 0.3f, DEFREC_OBSERVED};  // between two pixels
    const auto undecided = [&](float residual, uint32_t observation) {
        defrec_surface_sample found = expected;
        found.residual = residual;
        found.observation = observation;
        Spread spread;
        warp_spread(job, outputs(expected), outputs(found), spread);
        return spread["warp.undecided"].maximum() > 0;
    };
    CHECK(!undecided(0.3f, DEFREC_OBSERVED));
    CHECK(undecided(0, DEFREC_NO_DEPTH));
    CHECK(undecided(1.5f, DEFREC_OBSERVED));
    CHECK_THROWS_AS(undecided(kNan, DEFREC_NO_DEPTH), CaseFailure);
    CHECK_THROWS_AS(undecided(kInfinity, DEFREC_INCONSISTENT), CaseFailure);
    CHECK_THROWS_AS(undecided(0, 77), CaseFailure);
}
