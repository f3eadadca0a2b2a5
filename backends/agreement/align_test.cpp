// align against the reference: observations to the bit but for their information.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "backends/reference/stages.hpp"
#include "backends/shared/motion.hpp"
#include "backends/shared/test_align.hpp"
#include "sdk/contract/parameter_ends.hpp"
#include DEFREC_UNDER_TEST

using namespace defrec;
using namespace defrec::test;

namespace {

bool same(const defrec_patch_observation& a, const defrec_patch_observation& b) {
    bool result = a.u == b.u && a.v == b.v && a.score == b.score && a.valid == b.valid &&
                  a.reserved == b.reserved;
    for (int k = 0; k < 3; ++k)
        result = result && std::abs(a.information[k] - b.information[k]) <= 1e-4f;
    return result;
}

// The stage under test beside the reference.
class Pair {
  public:
    explicit Pair(const defrec_align_params& params)
        : reference_(reference::make_align(params, host_.host())),
          tested_(under_test::make_align(params, host_.host())) {}
    void check_equal(const AlignScene& scene) {
        const auto expected = observe(*reference_, scene);
        under_test::on_every_target([&] {
            const auto got = observe(*tested_, scene);
            REQUIRE(expected.size() == got.size());
            size_t different = 0;
            for (size_t i = 0; i < got.size(); ++i) different += !same(expected[i], got[i]);
            CHECK(different == 0);
        });
    }

  private:
    const TestHost host_{3};
    std::unique_ptr<Stage> reference_, tested_;
};

void mask_blocks(AlignScene& scene, uint32_t seed) {
    scene.mask.assign(scene.live.size(), 1);
    std::mt19937 random(seed);
    for (int k = 0; k < 80; ++k) {
        const size_t x = random() % (scene.params.width - 6),
                     y = random() % (scene.params.height - 6), side = 1 + random() % 6;
        for (size_t j = 0; j < side; ++j)
            for (size_t i = 0; i < side; ++i) scene.mask[(y + j) * scene.params.stride + x + i] = 0;
    }
}

}  // namespace

TEST_CASE(
    "observations equal the reference's, for every level, small to large radii and odd sizes") {
    if (!under_test::available()) return;
    for (const uint32_t level : {0u, 1u, 2u, 3u})
        for (const uint32_t radius : {1u, 4u, 5u, 7u})
            for (const uint32_t search : {1u, 3u, 7u, 16u}) {
                if (level == 3 && radius > 1) continue;  // no room
                CAPTURE(level);
                CAPTURE(radius);
                CAPTURE(search);
                AlignSceneOptions options;
                options.level = level;
                options.patch_radius = radius;
                options.search_radius = search;
                options.seed = level * 100 + radius * 10 + search;
                options.patches = 16;
                options.angle = 0.1;
                options.prediction_error = search / 2.0;
                AlignScene scene = make_align_scene(options);
                scene.params.min_score = 1000;
                scene.params.keep_predicted = search % 4 == 3 ? 1 : 0;
                Pair pair(scene.params);
                pair.check_equal(scene);
                mask_blocks(scene, options.seed);
                pair.check_equal(scene);
            }
}

TEST_CASE(
    "so do patches at the borders, stretched, turned and senseless ones, in dense and padded "
    "images") {
    if (!under_test::available()) return;
    for (const auto& [width, stride] :
         {std::pair(211u, 211u), std::pair(211u, 256u), std::pair(212u, 212u)})
        for (const uint32_t level : {0u, 1u}) {
            AlignSceneOptions options;
            options.width = width;
            options.stride = stride;
            options.level = level;
            options.patches = 1;
            options.search_radius = 8;
            AlignScene scene = make_align_scene(options);
            scene.params.min_score = 1;
            scene.params.texture = 1;
            std::mt19937 random(5);
            for (int k = 0; k < 400; ++k) {
                defrec_patch patch = scene.patches[0];
                patch.u = float(random() % (scene.params.width * 16)) / 16;
                patch.v = float(random() % (scene.params.height * 16)) / 16;
                defrec_patch_prediction prediction{};
                prediction.valid = 1;
                prediction.u = int32_t(random() % ((scene.params.width - 1) * 256 + 1));
                prediction.v = int32_t(random() % ((scene.params.height - 1) * 256 + 1));
                for (int m = 0; m < 4; ++m)
                    prediction.view_from_live[m] =
                        int32_t(random() % 131072) - 65536 + (m % 3 == 0 ? 65536 : 0);
                scene.patches.push_back(patch);
                scene.predictions.push_back(prediction);
            }
            scene.params.patches = uint32_t(scene.patches.size());
            AlignScene masked = scene;
            mask_blocks(masked, 9);
            for (const uint32_t keep : {0u, 1u}) {
                scene.params.keep_predicted = keep;
                Pair pair(scene.params);
                pair.check_equal(scene);
                pair.check_equal(masked);
            }
        }
}

TEST_CASE("so they do with each parameter at the ends of its range") {
    if (!under_test::available()) return;
    AlignSceneOptions options;
    options.patches = 16;
    options.angle = 0.1;
    AlignScene scene = make_align_scene(options);
    for_parameter_ends(defrec_align_params(scene.params),
                       [&](const char* name, const defrec_align_params& params) {
                           if (params.views != scene.params.views) return;  // of other buffers
                           CAPTURE(name);
                           AlignScene changed = scene;
                           changed.params = params;
                           Pair(params).check_equal(changed);
                       });
}

TEST_CASE("no patch has a score or a texture beyond the largest") {
    if (!under_test::available()) return;
    AlignScene scene = make_align_scene({});
    scene.params.keep_predicted = 1;
    scene.live = scene.view;
    const TestHost host;
    const auto found = [&](auto make, const defrec_align_params& params) {
        const auto observations = observe(*make(params, host.host()), scene);
        return std::count_if(observations.begin(), observations.end(),
                             [](const auto& observation) { return observation.valid != 0; });
    };
    for (const auto make : {reference::make_align, under_test::make_align}) {
        CHECK(found(make, scene.params) > 0);
        for (const uint32_t beyond : {4097u, 13500000u, uint32_t{INT32_MAX}, UINT32_MAX})
            for (const auto member :
                 {&defrec_align_params::min_score, &defrec_align_params::texture}) {
                defrec_align_params params = scene.params;
                params.*member = beyond;
                CHECK(found(make, params) == 0);
            }
    }
}

TEST_CASE("so do images of extreme contrast") {
    if (!under_test::available()) return;
    AlignSceneOptions options;
    options.patch_radius = 7;
    AlignScene scene = make_align_scene(options);
    for (uint8_t& value : scene.view) value = value > 120 ? 255 : 0;
    for (uint8_t& value : scene.live) value = value > 120 ? 255 : 0;
    Pair(scene.params).check_equal(scene);
}

TEST_CASE("several views are told apart") {
    if (!under_test::available()) return;
    AlignScene scene = make_align_scene({});
    AlignSceneOptions other;
    other.seed = 2;
    const AlignScene second = make_align_scene(other);
    std::vector<uint8_t> views(
        size_t(scene.params.stride) * scene.params.height + second.view.size(), 0);
    std::copy(second.view.begin(), second.view.end(), views.begin());
    std::copy(scene.view.begin(), scene.view.end(),
              views.begin() + std::ptrdiff_t(scene.params.stride * scene.params.height));
    scene.view = views;
    scene.params.views = 2;
    for (size_t i = 0; i < scene.patches.size(); i += 2) scene.patches[i].view = 1;
    Pair(scene.params).check_equal(scene);
    const auto observations =
        observe(*under_test::make_align(scene.params, TestHost().host()), scene);
    size_t right = 0, wrong = 0;
    for (size_t i = 0; i < observations.size(); ++i)
        (i % 2 == 0 ? right : wrong) += size_t(observations[i].valid);
    CHECK(right > scene.patches.size() * 9 / 20);
    CHECK(wrong < scene.patches.size() / 10);
}

namespace {

constexpr size_t kBeyond = 2;  // records that a caller's buffers have too many

struct Output {
    std::vector<defrec_patch_observation> observations;
    std::vector<defrec_patch_prediction> predictions;
};

// Both outputs, the inputs being the scene's predictions or, if given, motions.
Output run(Stage& stage, const AlignScene& scene, const std::vector<defrec_motion>& motions) {
    const InBuffer prepare[3] = {in_buffer(scene.patches), in_buffer(scene.view),
                                 scene.slopes.empty() ? InBuffer{} : in_buffer(scene.slopes)};
    stage.prepare(prepare);
    const size_t count = scene.patches.size() + kBeyond;
    Output output{std::vector<defrec_patch_observation>(count, {7, 7, 7, 7, {7, 7, 7}, 7}),
                  std::vector<defrec_patch_prediction>(count, {7, 7, {7, 7, 7, 7}, 7, 7})};
    const InBuffer in[4] = {in_buffer(scene.live),
                            {},
                            motions.empty() ? InBuffer{} : in_buffer(motions),
                            motions.empty() ? in_buffer(scene.predictions) : InBuffer{}};
    const OutBuffer out[2] = {out_buffer(output.observations), out_buffer(output.predictions)};
    stage.run(in, out);
    return output;
}

template <class Record>
bool identical(const std::vector<Record>& a, const std::vector<Record>& b) {
    return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]) == 0;
}

// The patches of a plane at 80 mm, each moved by some of six control points.
AlignScene plane(uint32_t level) {
    AlignSceneOptions options;
    options.level = level;
    AlignScene scene = make_align_scene(options);
    scene.params.nodes = 6;
    std::mt19937 random(3), random_slopes(4);
    for (defrec_patch& patch : scene.patches) {
        patch.position[0] = (patch.u - 105) * 80 / 500;
        patch.position[1] = (patch.v - 78) * 80 / 500;
        patch.position[2] = 80;
        patch.tangent_u[0] = patch.tangent_v[1] = 80.0f / 500.0f;
        float sum = 0;
        for (int k = 0; k < DEFREC_BLEND_NODES; ++k) {
            patch.node[k] = int32_t(random() % 6);
            sum += patch.weight[k] = float(1 + random() % 8);
        }
        for (float& weight : patch.weight) weight /= sum;
        defrec_patch_slope& slope = scene.slopes.emplace_back();
        for (float* weights : {slope.weight_u, slope.weight_v})
            for (int k = 1; k < DEFREC_BLEND_NODES; ++k)
                weights[0] -= weights[k] = 0.001f * (float(random_slopes() % 9) - 4) / 4;
    }
    return scene;
}

// Motions of six control points; those of odd index have the other sign, which is the same motion.
std::vector<defrec_motion> motions_of_six(double turn) {
    std::vector<defrec_motion> motions;
    for (int i = 0; i < 6; ++i) {
        const Vec3<double> axis{0.3 * std::sin(i), 0.3 * std::cos(i), 1};
        auto motion = from_rigid(rotation_from_vector(turn * axis),
                                 {0.2 + 0.05 * i, -0.4, 0.3 * std::sin(i)});
        if (i % 2 == 1) motion = {-1.0 * motion.real, -1.0 * motion.dual};
        motions.push_back(motion.store());
    }
    return motions;
}

// How many predictions are followed.
size_t check_predictions(const Output& expected, const Output& got) {
    size_t valid = 0;
    for (size_t i = 0; i < expected.predictions.size(); ++i) {
        const defrec_patch_prediction &a = expected.predictions[i], &b = got.predictions[i];
        CAPTURE(i);
        CHECK(a.valid == b.valid);
        CHECK(std::abs(a.u - b.u) <= 1);
        CHECK(std::abs(a.v - b.v) <= 1);
        for (int k = 0; k < 4; ++k) CHECK(std::abs(a.view_from_live[k] - b.view_from_live[k]) <= 4);
        valid += a.valid == 1;
    }
    return valid;
}

}  // namespace

TEST_CASE(
    "predictions for either view agree with the reference's, and the number of threads changes no "
    "bit") {
    if (!under_test::available()) return;
    const TestHost one(1), four(4);
    for (const auto& [level, right_view] :
         {std::pair(0u, 0u), std::pair(0u, 1u), std::pair(2u, 0u), std::pair(2u, 1u)})
        for (const double turn : {0.0, 0.1, 0.6}) {
            AlignScene scene = plane(level);
            scene.params.right_view = right_view;
            const auto motions = motions_of_six(turn);
            const Output expected =
                run(*reference::make_align(scene.params, one.host()), scene, motions);
            const Output a = run(*under_test::make_align(scene.params, one.host()), scene, motions);
            const Output b =
                run(*under_test::make_align(scene.params, four.host()), scene, motions);
            CHECK(check_predictions(expected, a) > scene.patches.size() / 2);
            CHECK(identical(a.observations, b.observations));
            CHECK(identical(a.predictions, b.predictions));
        }
}

TEST_CASE("the length of a motion's real part does not change what it does") {
    if (!under_test::available()) return;
    const TestHost host;
    for (const double turn : {0.0, 0.1}) {
        const AlignScene scene = plane(0);
        const auto motions = motions_of_six(turn);
        auto scaled = motions;
        constexpr float lengths[] = {1, 0.5f, 8, 1e-24f, 1e-30f, 1e25f};
        for (size_t i = 0; i < scaled.size(); ++i) {
            const float length = lengths[i];
            for (float* part : {scaled[i].real, scaled[i].dual})
                for (int c = 0; c < 4; ++c) part[c] *= length;
        }
        for (const auto make : {reference::make_align, under_test::make_align}) {
            const auto stage = make(scene.params, host.host());
            const Output expected = run(*stage, scene, motions);
            CHECK(check_predictions(expected, run(*stage, scene, scaled)) >
                  scene.patches.size() / 2);
        }
    }
}

TEST_CASE("a motion that is not finite takes no other control point's patches along") {
    if (!under_test::available()) return;
    const TestHost host;
    const AlignScene scene = plane(0);
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()})
        for (const bool dual : {false, true}) {
            CAPTURE(bad);
            CAPTURE(dual);
            auto motions = motions_of_six(0.1);
            (dual ? motions[2].dual : motions[2].real)[1] = bad;
            const Output good =
                run(*under_test::make_align(scene.params, host.host()), scene, motions_of_six(0.1));
            const Output got =
                run(*under_test::make_align(scene.params, host.host()), scene, motions);
            size_t untouched = 0;
            for (size_t i = 0; i < scene.patches.size(); ++i) {
                if (std::count(scene.patches[i].node, scene.patches[i].node + DEFREC_BLEND_NODES,
                               2) != 0)
                    continue;
                CHECK(std::memcmp(&good.observations[i], &got.observations[i],
                                  sizeof got.observations[i]) == 0);
                ++untouched;
            }
            CHECK(untouched > 20);
        }
}

TEST_CASE("given predictions are handed on, and what lies behind the records stays") {
    if (!under_test::available()) return;
    const TestHost host;
    const AlignScene scene = make_align_scene({});
    const auto tested = under_test::make_align(scene.params, host.host());
    const Output got = run(*tested, scene, {}),
                 expected = run(*reference::make_align(scene.params, host.host()), scene, {});
    for (size_t i = 0; i < expected.observations.size(); ++i)
        CHECK(same(expected.observations[i], got.observations[i]));
    CHECK(identical(expected.predictions, got.predictions));

    AlignScene empty = scene;
    empty.patches.clear();
    empty.predictions.clear();
    const Output none = run(*tested, empty, {});
    for (const auto& observation : none.observations) CHECK(observation.valid == 7);
    for (const auto& prediction : none.predictions) CHECK(prediction.valid == 7);
}

TEST_CASE("align refuses a template whose numbers are not finite") {
    if (!under_test::available()) return;
    const TestHost host;
    const AlignScene scene = plane(0);
    const auto motions = motions_of_six(0.1);
    const auto refuses = [&](auto number) {
        for (const auto make : {reference::make_align, under_test::make_align})
            for (const float wrong : {std::numeric_limits<float>::quiet_NaN(),
                                      std::numeric_limits<float>::infinity()}) {
                AlignScene bad = scene;
                number(bad) = wrong;
                CHECK_THROWS_WITH_AS(run(*make(bad.params, host.host()), bad, motions),
                                     doctest::Contains("patch 3"), StageError);
            }
    };
    refuses([](AlignScene& s) -> float& { return s.patches[3].position[1]; });
    refuses([](AlignScene& s) -> float& { return s.patches[3].weight[3]; });
    refuses([](AlignScene& s) -> float& { return s.patches[3].tangent_u[0]; });
    refuses([](AlignScene& s) -> float& { return s.patches[3].tangent_v[2]; });
    refuses([](AlignScene& s) -> float& { return s.slopes[3].weight_u[1]; });
    refuses([](AlignScene& s) -> float& { return s.slopes[3].weight_v[2]; });
}

TEST_CASE("align refuses what it cannot compute") {
    if (!under_test::available()) return;
    const TestHost host;
    AlignScene scene = make_align_scene({});
    const auto refuses = [&](auto spoil) {
        AlignScene bad = scene;
        spoil(bad);
        CHECK_THROWS_AS(observe(*under_test::make_align(bad.params, host.host()), bad), StageError);
    };
    refuses([](AlignScene& s) { s.params.level = 4; });
    refuses([](AlignScene& s) { s.params.search_radius = 17; });
    refuses([](AlignScene& s) { s.patches[3].view = 1; });
    refuses([](AlignScene& s) { s.patches[3].node[2] = 1; });
    refuses([](AlignScene& s) { s.view.pop_back(); });
    refuses([](AlignScene& s) { s.live.pop_back(); });
    refuses([](AlignScene& s) { s.predictions.pop_back(); });
    const std::vector<uint8_t>& live = scene.live;
    std::vector<defrec_patch_observation> observations(scene.patches.size());
    const InBuffer in[1] = {in_buffer(live)};
    const OutBuffer out[1] = {out_buffer(observations)};
    CHECK_THROWS_AS(under_test::make_align(scene.params, host.host())->run(in, out),
                    StageError);  // before prepare
}
