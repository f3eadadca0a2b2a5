// The sample jobs, on the reference: each has something of everything that its stage gives.
#include "conformance/scenes/sample_job.hpp"

#include <doctest/doctest.h>

#include <algorithm>

using namespace defrec::conformance;

namespace {

class Samples {
  public:
    Samples() : plugin_(find_backend("reference"), ""), session_(plugin_) {}
    std::vector<Bytes> outputs(uint32_t stage, uint64_t seed = 1) {
        return run_plainly(session_, sample_job(stage, seed));
    }
    Session& session() { return session_; }

  private:
    Plugin plugin_;
    Session session_;
};

template <class T, class Holds>
size_t count(const Bytes& bytes, Holds holds) {
    const std::vector<T> values = as<T>(bytes);
    return size_t(std::count_if(values.begin(), values.end(), holds));
}

}  // namespace

TEST_CASE("images: pixels that are usable and such that are not, disparities and holes, features") {
    Samples samples;
    const Bytes mask = samples.outputs(DEFREC_STAGE_RECTIFY)[1];
    CHECK(count<uint8_t>(mask, [](uint8_t m) { return m == 255; }) > mask.size() / 3);
    CHECK(count<uint8_t>(mask, [](uint8_t m) { return m == 0; }) > 20);
    const std::vector<Bytes> stereo = samples.outputs(DEFREC_STAGE_STEREO);
    const size_t pixels = stereo[0].size() / 2;
    const size_t holes =
        count<int16_t>(stereo[0], [](int16_t d) { return d == DEFREC_DISPARITY_NONE; });
    CHECK(holes > 50);
    CHECK(holes < pixels * 3 / 4);
    CHECK(as<uint32_t>(samples.outputs(DEFREC_STAGE_ORB)[0])[0] >= 10);
}

TEST_CASE("templates: matches, patches, references, a solution and observed points") {
    Samples samples;
    const size_t matches =
        count<defrec_match>(samples.outputs(DEFREC_STAGE_MATCH)[0],
                            [](const defrec_match& m) { return m.position[2] > 0; });
    CHECK(matches >= 8);
    CHECK(matches < 40);
    CHECK(count<defrec_patch_observation>(
              samples.outputs(DEFREC_STAGE_ALIGN)[0],
              [](const defrec_patch_observation& o) { return o.valid == 1; }) >= 8);
    const auto ransac = as<defrec_ransac_summary>(samples.outputs(DEFREC_STAGE_RANSAC)[1])[0];
    CHECK(ransac.references > 0);
    CHECK(ransac.inliers > 20);
    CHECK(ransac.inliers < 60);
    const auto lm = as<defrec_lm_summary>(samples.outputs(DEFREC_STAGE_LM)[1])[0];
    CHECK(lm.failed == 0);
    CHECK(lm.final_cost < lm.initial_cost / 2);
    CHECK(lm.icp_points > 20);
    CHECK(lm.patches > 20);
    const Bytes warp = samples.outputs(DEFREC_STAGE_WARP)[0];
    CHECK(count<defrec_surface_sample>(warp, [](const defrec_surface_sample& s) {
              return s.observation == DEFREC_OBSERVED;
          }) > 20);
    CHECK(count<defrec_surface_sample>(warp, [](const defrec_surface_sample& s) {
              return s.observation != DEFREC_OBSERVED;
          }) > 0);
}

TEST_CASE("another seed gives another job of the same sizes, and the same seed the same") {
    Samples samples;
    for (uint32_t stage = 0; stage < DEFREC_STAGE_COUNT_V1; ++stage) {
        CAPTURE(stage);
        const auto one = samples.outputs(stage, 1), again = samples.outputs(stage, 1),
                   other = samples.outputs(stage, 2);
        CHECK(one == again);
        CHECK(one != other);
        REQUIRE(one.size() == other.size());
        for (size_t i = 0; i < one.size(); ++i) CHECK(one[i].size() == other[i].size());
    }
}

TEST_CASE("what the reference writes is known byte by byte") {
    Samples samples;
    const Expected orb = run_reference(samples.session(), sample_job(DEFREC_STAGE_ORB));
    const size_t features = as<uint32_t>(orb.outputs[0])[0];
    const auto written = size_t(std::count(orb.written[1].begin(), orb.written[1].end(), true));
    CHECK(written == features * sizeof(defrec_feature));
    CHECK(!orb.written[1][written]);
}

TEST_CASE("buffers have the sizes of the stages' contracts") {
    for (uint32_t stage = 0; stage < DEFREC_STAGE_COUNT_V1; ++stage) {
        const StageJob job = sample_job(stage, 1);
        CAPTURE(stage);
        for (size_t i = 0; i < job.in.size(); ++i) {
            CAPTURE(i);
            if (job.in[i].given) CHECK(job.in[i].bytes.size() >= job.params.input_bytes(i));
        }
        size_t sized = 0;
        for (size_t i = 0; i < job.out.size(); ++i) {
            CAPTURE(i);
            // What prepare decides the contract does not know beforehand.
            if (job.params.output_bytes(i) == 0) continue;
            CHECK(job.out[i].size == job.params.output_bytes(i));
            ++sized;
        }
        const bool counted = stage == DEFREC_STAGE_MATCH || stage == DEFREC_STAGE_ALIGN;
        CHECK((sized > 0) == !counted);
    }
}
