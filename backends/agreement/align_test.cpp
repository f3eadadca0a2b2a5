// align against the reference: observations to the bit but for their information.
#include <doctest/doctest.h>

#include <cstring>

#include "backends/reference/stages.hpp"
#include "backends/shared/motion.hpp"
#include "backends/shared/test_align.hpp"
#include DEFREC_UNDER_TEST

using namespace defrec;
using namespace defrec::test;

namespace {

bool same(const defrec_patch_observation& a, const defrec_patch_observation& b) {
    bool result = a.u == b.u && a.v == b.v && a.score == b.score && a.valid == b.valid && a.reserved == b.reserved;
    for (int k = 0; k < 3; ++k) result = result && std::abs(a.information[k] - b.information[k]) <= 1e-4f;
    return result;
}

void check_equal(const AlignScene& scene) {
    const TestHost host(3);
    const auto expected = observe(*reference::make_align(scene.params, host.host()), scene);
    under_test::on_every_target([&] {
        const auto got = observe(*under_test::make_align(scene.params, host.host()), scene);
        REQUIRE(expected.size() == got.size());
        size_t different = 0;
        for (size_t i = 0; i < got.size(); ++i) different += !same(expected[i], got[i]);
        CHECK(different == 0);
    });
}

void mask_blocks(AlignScene& scene, uint32_t seed) {
    scene.mask.assign(scene.live.size(), 1);
    std::mt19937 random(seed);
    for (int k = 0; k < 80; ++k) {
        const size_t x = random() % (scene.params.width - 6), y = random() % (scene.params.height - 6),
                     side = 1 + random() % 6;
        for (size_t j = 0; j < side; ++j)
            for (size_t i = 0; i < side; ++i) scene.mask[(y + j) * scene.params.stride + x + i] = 0;
    }
}

}  // namespace

TEST_CASE("observations equal the reference's, for every radius, level and odd sizes") {
    if (!under_test::available()) return;
    for (const uint32_t level : {0u, 1u, 2u})
        for (const uint32_t radius : {1u, 4u, 5u, 7u})
            for (const uint32_t search : {1u, 7u, 16u}) {
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
                check_equal(scene);
                mask_blocks(scene, options.seed);
                check_equal(scene);
            }
}

TEST_CASE("so do patches at the borders, stretched, turned and senseless ones, in dense and padded images") {
    if (!under_test::available()) return;
    for (const uint32_t stride : {211u, 256u})
        for (const uint32_t level : {0u, 1u}) {
            AlignSceneOptions options;
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
            check_equal(scene);
            mask_blocks(scene, 9);
            check_equal(scene);
        }
}

TEST_CASE("so do images of extreme contrast") {
    if (!under_test::available()) return;
    AlignSceneOptions options;
    options.patch_radius = 7;
    AlignScene scene = make_align_scene(options);
    for (uint8_t& value : scene.view) value = value > 120 ? 255 : 0;
    for (uint8_t& value : scene.live) value = value > 120 ? 255 : 0;
    check_equal(scene);
}

TEST_CASE("several views are told apart") {
    if (!under_test::available()) return;
    AlignScene scene = make_align_scene({});
    AlignSceneOptions other;
    other.seed = 2;
    const AlignScene second = make_align_scene(other);
    std::vector<uint8_t> views(size_t(scene.params.stride) * scene.params.height + second.view.size(), 0);
    std::copy(second.view.begin(), second.view.end(), views.begin());
    std::copy(scene.view.begin(), scene.view.end(),
              views.begin() + std::ptrdiff_t(scene.params.stride * scene.params.height));
    scene.view = views;
    scene.params.views = 2;
    for (size_t i = 0; i < scene.patches.size(); i += 2) scene.patches[i].view = 1;
    check_equal(scene);
    const auto observations = observe(*under_test::make_align(scene.params, TestHost().host()), scene);
    size_t right = 0, wrong = 0;
    for (size_t i = 0; i < observations.size(); ++i)
        (i % 2 == 0 ? right : wrong) += size_t(observations[i].valid);
    CHECK(right > scene.patches.size() * 9 / 20);
    CHECK(wrong < scene.patches.size() / 10);
}

TEST_CASE("the number of threads changes no bit, and predictions agree with the reference's") {
    if (!under_test::available()) return;
    AlignScene scene = make_align_scene({});
    for (defrec_patch& patch : scene.patches) {
        patch.position[0] = (patch.u - 105) * 80 / 500;
        patch.position[1] = (patch.v - 78) * 80 / 500;
        patch.position[2] = 80;
        patch.tangent_u[0] = patch.tangent_v[1] = 80.0f / 500.0f;
    }
    const double turn[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, step[3] = {0.2, -0.4, 0.3};
    const std::vector<defrec_motion> motions = {from_rigid(turn, step).store()};
    const auto run = [&](bool fast, uint32_t threads, std::vector<defrec_patch_prediction>& predictions) {
        const TestHost host(threads);
        const auto stage = fast ? under_test::make_align(scene.params, host.host())
                                : reference::make_align(scene.params, host.host());
        const InBuffer prepare[2] = {in_buffer(scene.patches), in_buffer(scene.view)};
        stage->prepare(prepare);
        std::vector<defrec_patch_observation> observations(scene.patches.size());
        predictions.resize(scene.patches.size());
        const InBuffer in[3] = {in_buffer(scene.live), {}, in_buffer(motions)};
        const OutBuffer out[2] = {out_buffer(observations), out_buffer(predictions)};
        stage->run(in, out);
        return observations;
    };
    std::vector<defrec_patch_prediction> one, four, reference;
    const auto a = run(true, 1, one), b = run(true, 4, four);
    run(false, 1, reference);
    CHECK(std::memcmp(a.data(), b.data(), a.size() * sizeof a[0]) == 0);
    for (size_t i = 0; i < one.size(); ++i) {
        CHECK(std::memcmp(&one[i], &four[i], sizeof one[i]) == 0);
        REQUIRE(one[i].valid == reference[i].valid);
        CHECK(std::abs(one[i].u - reference[i].u) <= 1);
        CHECK(std::abs(one[i].v - reference[i].v) <= 1);
        for (int k = 0; k < 4; ++k)
            CHECK(std::abs(one[i].view_from_live[k] - reference[i].view_from_live[k]) <= 4);
    }
}
