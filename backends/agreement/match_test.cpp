// The stage match against the reference: Hamming part to the bit, lifting within float rounding;
// and its rules.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "backends/reference/stages.hpp"
#include "backends/shared/test_host.hpp"
#include "sdk/contract/parameter_ends.hpp"
#include "sdk/contract/stage_params.hpp"
#include DEFREC_UNDER_TEST

namespace {

using namespace defrec;

struct Scene {
    defrec_match_params params;
    std::vector<defrec_landmark> landmarks;
    std::vector<defrec_feature> features;
    std::vector<int16_t> disparity;
    uint32_t count;
};

// Half of the features are landmarks with a few bits turned, some of them twice; depth has holes.
Scene random_scene(uint32_t landmarks, uint32_t features, uint32_t seed) {
    Scene scene{};
    std::mt19937 random(seed);
    DEFREC_INIT(&scene.params);
    scene.params.landmarks = landmarks;
    scene.params.features = features + 5;
    scene.params.width = 97;
    scene.params.height = 71;
    scene.params.stride = 101;
    scene.params.camera = {180, 180, 47.3, 36.1, 4.6, 0};
    fill_defaults(scene.params);
    scene.count = features;
    scene.landmarks.resize(landmarks);
    for (defrec_landmark& landmark : scene.landmarks)
        for (uint32_t& word : landmark.descriptor) word = uint32_t(random());
    scene.features.resize(features);
    for (defrec_feature& feature : scene.features) {
        feature.x = int32_t(random() % (97 * 16 - 15));
        feature.y = int32_t(random() % 4 == 0 ? 500 : random() % (71 * 16 - 15));
        for (uint32_t& word : feature.descriptor) word = uint32_t(random());
        if (random() % 2 == 0 && landmarks > 0) {
            std::memcpy(feature.descriptor, scene.landmarks[random() % landmarks].descriptor, 32);
            for (uint32_t flips = random() % 90; flips > 0; --flips)
                feature.descriptor[random() % 8] ^= 1u << random() % 32;
        }
    }
    scene.disparity.resize(101 * 70 + 97);
    for (int16_t& d : scene.disparity)
        d = random() % 4 == 0 ? int16_t(DEFREC_DISPARITY_NONE) : int16_t(600 + random() % 40);
    return scene;
}

std::vector<defrec_match> run(Stage& stage, const Scene& scene) {
    const InBuffer landmarks[] = {
        {scene.landmarks.data(), scene.landmarks.size() * sizeof(defrec_landmark)}};
    stage.prepare(landmarks);
    std::vector<defrec_match> matches(scene.landmarks.size());
    const defrec_feature none{};  // the buffer is given even where it holds nothing
    const InBuffer in[] = {{&scene.count, 4},
                           {scene.features.empty() ? &none : scene.features.data(),
                            scene.features.size() * sizeof(defrec_feature)},
                           {scene.disparity.data(), scene.disparity.size() * 2}};
    const OutBuffer out[] = {{matches.data(), matches.size() * sizeof(defrec_match)}};
    stage.run(in, out);
    return matches;
}

std::vector<defrec_match> agreed(const Scene& scene) {
    const test::TestHost one(1), four(4);
    const std::vector<defrec_match> expected =
        run(*reference::make_match(scene.params, one.host()), scene);
    under_test::on_every_target([&] {
        const std::vector<defrec_match> fast =
            run(*under_test::make_match(scene.params, four.host()), scene);
        const std::vector<defrec_match> alone =
            run(*under_test::make_match(scene.params, one.host()), scene);
        CHECK((fast.empty() ||
               std::memcmp(fast.data(), alone.data(), fast.size() * sizeof fast[0]) == 0));
        REQUIRE(fast.size() == expected.size());
        for (size_t i = 0; i < fast.size(); ++i) {
            CHECK(fast[i].feature == expected[i].feature);
            CHECK(fast[i].distance == expected[i].distance);
            CHECK(fast[i].second == expected[i].second);
            CHECK(fast[i].u == expected[i].u);
            CHECK(fast[i].v == expected[i].v);
            CHECK(fast[i].weight == expected[i].weight);
            for (int k = 0; k < 3; ++k)
                CHECK(std::abs(fast[i].position[k] - expected[i].position[k]) <= 2e-5);
        }
    });
    return expected;
}

TEST_CASE("equals the reference for any number of landmarks and features") {
    if (!under_test::available()) return;
    const uint32_t counts[][2] = {{1, 1},     {1, 40},    {40, 1}, {17, 33}, {16, 16},
                                  {255, 301}, {500, 480}, {9, 0},  {0, 9},   {1300, 2200}};
    for (const auto& n : counts) {
        CAPTURE(n[0]);
        CAPTURE(n[1]);
        Scene scene = random_scene(n[0], n[1], n[0] * 1000 + n[1]);
        scene.params.landmarks = std::max(scene.params.landmarks, 1u);
        const std::vector<defrec_match> matches = agreed(scene);
        size_t found = 0, lifted = 0;
        for (const defrec_match& match : matches)
            found += match.feature >= 0, lifted += match.weight > 0;
        if (n[0] > 200) {
            CHECK(found > n[0] / 8);
            CHECK(lifted > found / 3);
            CHECK(lifted < found);
        }
    }
}

TEST_CASE("equals the reference with each parameter at the ends of its range") {
    if (!under_test::available()) return;
    Scene scene = random_scene(255, 301, 4);
    for_parameter_ends(defrec_match_params(scene.params),
                       [&](const char* name, const defrec_match_params& params) {
                           CAPTURE(name);
                           scene.params = params;
                           agreed(scene);
                       });
}

TEST_CASE("ties go to the lowest index, and a match must be mutual") {
    if (!under_test::available()) return;
    Scene scene = random_scene(3, 3, 1);
    std::memcpy(scene.landmarks[1].descriptor, scene.landmarks[0].descriptor, 32);
    for (defrec_feature& feature : scene.features)
        std::memcpy(feature.descriptor, scene.landmarks[0].descriptor, 32);
    scene.params.ratio = 256;
    const std::vector<defrec_match> matches = agreed(scene);
    CHECK(matches[0].feature == 0);
    CHECK(matches[0].distance == 0);
    CHECK(matches[0].second == 0);
    CHECK(matches[1].feature == -1);  // features prefer landmark 0
    CHECK(matches[1].distance == 0);
    CHECK(matches[2].feature == -1);
}

TEST_CASE("features at the ends of the numbers are not at one place") {
    if (!under_test::available()) return;
    constexpr int32_t kFirst = std::numeric_limits<int32_t>::min(),
                      kLast = std::numeric_limits<int32_t>::max();
    Scene scene = random_scene(1, 3, 2);
    for (defrec_feature& feature : scene.features)
        std::memcpy(feature.descriptor, scene.landmarks[0].descriptor, 32);
    scene.features[1].descriptor[0] ^= 1;
    scene.features[2].descriptor[0] ^= 3;
    const int32_t places[][2] = {{kFirst, kLast}, {kLast, kFirst}, {kFirst, 0}, {0, kFirst}};
    for (const auto& place : places) {
        scene.features[0].x = place[0];
        scene.features[1].x = place[1];
        scene.features[0].y = scene.features[1].y = 0;
        CHECK(agreed(scene)[0].second == 1);
        std::swap(scene.features[0].x, scene.features[0].y);
        std::swap(scene.features[1].x, scene.features[1].y);
        CHECK(agreed(scene)[0].second == 1);
    }
    scene.features[0] = scene.features[1];
    std::memcpy(scene.features[0].descriptor, scene.landmarks[0].descriptor, 32);
    CHECK(agreed(scene)[0].second == 2);
}

TEST_CASE("ties go to the lowest index among many") {
    if (!under_test::available()) return;
    Scene scene = random_scene(300, 700, 6);
    for (size_t f = 0; f < scene.features.size(); ++f)
        std::memcpy(scene.features[f].descriptor, scene.landmarks[f % 3].descriptor, 32);
    for (size_t i = 3; i < scene.landmarks.size(); ++i)
        std::memcpy(scene.landmarks[i].descriptor, scene.landmarks[i % 3].descriptor, 32);
    scene.params.ratio = 256;
    const std::vector<defrec_match> matches = agreed(scene);
    for (int32_t i = 0; i < 300; ++i) CHECK(matches[size_t(i)].feature == (i < 3 ? i : -1));
}

TEST_CASE(
    "the second best is at another place: the same corner on another level does not speak against "
    "a match") {
    if (!under_test::available()) return;
    Scene scene = random_scene(1, 3, 8);
    const auto turn = [&](uint32_t f, int bits, int32_t x, int32_t y) {
        std::memcpy(scene.features[f].descriptor, scene.landmarks[0].descriptor, 32);
        for (int bit = 0; bit < bits; ++bit)
            scene.features[f].descriptor[bit / 32] ^= 1u << bit % 32;
        scene.features[f].x = x;
        scene.features[f].y = y;
    };
    turn(0, 120, 100, 100);
    turn(1, 41, 564, 436);
    turn(2, 40, 500, 500);
    CHECK(agreed(scene)[0].second == 120);
    CHECK(agreed(scene)[0].feature == 2);
    turn(1, 41, 565, 500);
    CHECK(agreed(scene)[0].second == 41);
    CHECK(agreed(scene)[0].feature == -1);
    turn(1, 41, 500, 435);
    CHECK(agreed(scene)[0].second == 41);
}

TEST_CASE("the largest distance and the ratio are the last that are accepted") {
    if (!under_test::available()) return;
    Scene scene = random_scene(1, 2, 2);
    uint32_t* near = scene.features[0].descriptor;
    uint32_t* far = scene.features[1].descriptor;
    const auto turn = [&](uint32_t* descriptor, int bits) {
        std::memcpy(descriptor, scene.landmarks[0].descriptor, 32);
        for (int bit = 0; bit < bits; ++bit) descriptor[bit / 32] ^= 1u << bit % 32;
    };
    scene.features[1].x = scene.features[0].x < 700 ? scene.features[0].x + 100 : 0;
    turn(near, 64);
    turn(far, 128);
    scene.params.ratio = 128;
    CHECK(agreed(scene)[0].feature == 0);
    turn(far, 127);
    CHECK(agreed(scene)[0].feature == -1);
    turn(near, 65);
    turn(far, 200);
    CHECK(agreed(scene)[0].feature == -1);
    scene.params.max_distance = 65;
    CHECK(agreed(scene)[0].feature == 0);
}

TEST_CASE("a match is lifted with the disparity at its pixel, and has no weight without one") {
    if (!under_test::available()) return;
    Scene scene = random_scene(1, 1, 3);
    std::memcpy(scene.features[0].descriptor, scene.landmarks[0].descriptor, 32);
    scene.features[0].x = 20 * 16;
    scene.features[0].y = 30 * 16;
    std::fill(scene.disparity.begin(), scene.disparity.end(), int16_t(10 * 16));
    defrec_match match = agreed(scene)[0];
    CHECK(match.u == 20);
    CHECK(match.v == 30);
    CHECK(match.weight == 1);
    const double z = 180 * 4.6 / 10;
    CHECK(match.position[2] == doctest::Approx(z));
    CHECK(match.position[0] == doctest::Approx((20 - 47.3) * z / 180));
    CHECK(match.position[1] == doctest::Approx((30 - 36.1) * z / 180));
    std::fill(scene.disparity.begin(), scene.disparity.end(), int16_t(DEFREC_DISPARITY_NONE));
    match = agreed(scene)[0];
    CHECK(match.feature == 0);
    CHECK(match.weight == 0);
    CHECK(match.position[2] == 0);
}

TEST_CASE("row 24: a count beyond the largest is cut, and short buffers are refused") {
    if (!under_test::available()) return;
    Scene scene = random_scene(4, 8, 4);
    const test::TestHost host;
    const auto stage = under_test::make_match(scene.params, host.host());
    const std::vector<defrec_match> held = run(*stage, scene);
    scene.count = 1000000;
    if (under_test::kReadsCounts) {
        CHECK_THROWS_AS(run(*stage, scene), StageError);
    } else {  // what the buffer does not hold is left out
        const std::vector<defrec_match> cut = run(*stage, scene);
        CHECK(std::memcmp(cut.data(), held.data(), held.size() * sizeof held[0]) == 0);
    }
    scene.features.resize(scene.params.features);
    CHECK(run(*stage, scene).size() == 4);
    scene.disparity.pop_back();
    CHECK_THROWS_AS(run(*stage, scene), StageError);
}

TEST_CASE("parameters out of range are refused") {
    if (!under_test::available()) return;
    const test::TestHost host;
    const auto refused = [&](auto change) {
        Scene scene = random_scene(4, 4, 5);
        change(scene.params);
        CHECK_THROWS_AS(under_test::make_match(scene.params, host.host()), StageError);
        CHECK_THROWS_AS(reference::make_match(scene.params, host.host()), StageError);
    };
    refused([](auto& p) { p.landmarks = 0; });
    refused([](auto& p) { p.features = 65536; });
    refused([](auto& p) { p.max_distance = 257; });
    refused([](auto& p) { p.ratio = 257; });
    refused([](auto& p) { p.stride = p.width - 1; });
    refused([](auto& p) { p.camera.fx = 0; });
}

}  // namespace
