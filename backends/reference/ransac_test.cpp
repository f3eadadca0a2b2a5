// Tests of the definition of ransac: what it finds, and what it must not.
#include <doctest/doctest.h>

#include "backends/definition/test_ransac.hpp"
#include "backends/reference/stages.hpp"

using namespace defrec;
using namespace defrec::test;

namespace {
RansacResult run(const RansacScene& scene) {
    const TestHost host;
    return run_ransac(*reference::make_ransac(scene.params, host.host()), scene);
}
}  // namespace

TEST_CASE("rotations up to 60 degrees with 85 % outliers are found in 19 of 20 scenes") {
    for (const double degrees : {10.0, 30.0, 60.0}) {
        CAPTURE(degrees);
        int found = 0;
        double right = 0, kept_right = 0, kept = 0;
        for (uint32_t seed = 1; seed <= 20; ++seed) {
            const RansacScene scene = make_ransac_scene(seed, 300, 0.85, degrees);
            const RansacResult result = run(scene);
            found += result.summary.references > 0 &&
                     degrees_between(result.summary.rotation, scene.rotation) < 3;
            for (size_t i = 0; i < scene.matches.size(); ++i) {
                right += scene.right[i];
                kept += result.matches[i].weight > 0;
                kept_right += scene.right[i] && result.matches[i].weight > 0;
            }
        }
        CHECK(found >= 19);
        CHECK(kept_right / right > 0.9);
        CHECK(kept_right / kept > 0.75);
    }
}

TEST_CASE("with half the matches right the motion is exact, and the summary says what happened") {
    const RansacScene scene = make_ransac_scene(4, 400, 0.5, 25);
    const RansacResult result = run(scene);
    CHECK(degrees_between(result.summary.rotation, scene.rotation) < 0.5);
    CHECK((Eigen::Map<const Eigen::Vector3f>(result.summary.translation).cast<double>() -
           scene.translation)
              .norm() < 1.0);
    CHECK(result.summary.valid_matches == 400);
    CHECK(result.summary.references >= 8);
    int kept = 0;
    for (const defrec_match& match : result.matches) kept += match.weight > 0.5f;
    CHECK(result.summary.inliers == kept);
    CHECK(result.summary.best_support >= 180);
}

TEST_CASE("only weights change, and they are 0 or at least the bound") {
    const RansacScene scene = make_ransac_scene(5, 200, 0.4, 15);
    const RansacResult result = run(scene);
    for (size_t i = 0; i < scene.matches.size(); ++i) {
        defrec_match match = result.matches[i];
        CHECK((match.weight == 0.0f ||
               (match.weight >= ransac::kKeptWeight && match.weight <= 1.0f)));
        match.weight = scene.matches[i].weight;
        CHECK(std::memcmp(&match, &scene.matches[i], sizeof match) == 0);
    }
}

TEST_CASE("nothing is accepted when every match is wrong") {
    for (const uint32_t count : {20u, 100u, 300u, 1000u}) {
        CAPTURE(count);
        RansacScene scene = make_ransac_scene(count, count, 1.0, 30);
        scene.params.threshold_mm = 0;
        const RansacResult result = run(scene);
        CHECK(result.summary.references == 0);
        CHECK(result.summary.inliers == 0);
        for (const defrec_match& match : result.matches) CHECK(match.weight == 0);
        CHECK(degrees_between(result.summary.rotation, Eigen::Matrix3d::Identity()) == 0);
    }
}

TEST_CASE("a rotation is never a reflection, also where a mirror image would fit better") {
    RansacScene scene = make_ransac_scene(6, 200, 0.0, 0);
    for (size_t i = 0; i < scene.matches.size(); ++i) {
        scene.matches[i].position[0] = -scene.landmarks[i].position[0];
        scene.matches[i].position[1] = scene.landmarks[i].position[1];
        scene.matches[i].position[2] = scene.landmarks[i].position[2];
    }
    CHECK(determinant(run(scene).summary.rotation) == doctest::Approx(1));
    for (uint32_t seed = 0; seed < 10; ++seed)
        CHECK(determinant(run(make_ransac_scene(seed, 100, 0.85, 120)).summary.rotation) ==
              doctest::Approx(1));
}

TEST_CASE("fewer matches than the least support are not trusted") {
    const RansacScene scene = make_ransac_scene(7, 5, 0.0, 10);
    const RansacResult result = run(scene);
    CHECK(result.summary.valid_matches == 5);
    CHECK(result.summary.references == 0);
    CHECK(result.matches[0].weight == 0);
    CHECK(run(make_ransac_scene(7, 8, 0.0, 10)).summary.references > 0);
}

TEST_CASE(
    "matches without feature, without depth or with numbers that are not finite take no part") {
    RansacScene scene = make_ransac_scene(8, 60, 0.0, 10);
    scene.matches[0].feature = -1;
    scene.matches[1].weight = 0;
    scene.matches[2].position[1] = NAN;
    scene.landmarks[3].position[0] = INFINITY;
    const RansacResult result = run(scene);
    CHECK(result.summary.valid_matches == 56);
    for (size_t i = 0; i < 4; ++i) CHECK(result.matches[i].weight == 0);
    CHECK(result.matches[10].weight > 0);
    CHECK(degrees_between(result.summary.rotation, scene.rotation) < 2);
}

TEST_CASE("identical points, points on a line and no points at all give finite numbers") {
    RansacScene scene = make_ransac_scene(9, 30, 0.0, 0);
    for (size_t i = 0; i < 30; ++i)
        for (size_t k = 0; k < 3; ++k)
            scene.landmarks[i].position[k] = scene.matches[i].position[k] = 50;
    RansacResult result = run(scene);
    CHECK(determinant(result.summary.rotation) == doctest::Approx(1));
    CHECK(result.summary.inliers == 30);
    for (size_t i = 0; i < 30; ++i)
        scene.landmarks[i].position[0] = scene.matches[i].position[0] = float(i);
    result = run(scene);
    CHECK(determinant(result.summary.rotation) == doctest::Approx(1));
    CHECK(result.summary.inliers == 30);
    for (defrec_match& match : scene.matches) match.feature = -1;
    result = run(scene);
    CHECK(result.summary.valid_matches == 0);
    CHECK(result.summary.rotation[0] == 1);
}

TEST_CASE("two parts that move differently are both kept") {
    RansacScene scene = make_ransac_scene(10, 300, 0.0, 0);
    const Eigen::Matrix3f turn =
        Eigen::AngleAxisf(0.8f, Eigen::Vector3f::UnitZ()).toRotationMatrix();
    for (size_t i = 0; i < 300; ++i) {
        Eigen::Map<Eigen::Vector3f> live(scene.matches[i].position);
        if (scene.landmarks[i].position[0] > 0) live = (turn * live).eval();
    }
    const RansacResult result = run(scene);
    CHECK(result.summary.inliers > 280);
    CHECK(result.summary.best_support < 200);
}

TEST_CASE("references are distinct, spread over the matches, and follow the seed") {
    for (const uint32_t count : {30u, 31u, 100u, 5000u}) {
        uint32_t before = 0, moved = 0;
        for (uint32_t k = 0; k < 30; ++k) {
            const uint32_t index = ransac::reference_index(7, k, 30, count);
            CHECK(index < count);
            if (k > 0) CHECK(index > before);
            before = index;
            moved += index != ransac::reference_index(8, k, 30, count);
        }
        if (count > 100) CHECK(moved > 25);
    }
    CHECK(ransac::random_bits(0, 0) == 0xe220a8397b1dcdafu);  // SplitMix64 of seed 0
}

TEST_CASE("bad parameters and buffers are refused") {
    const TestHost host;
    RansacScene scene = make_ransac_scene(1, 10, 0, 0);
    const auto stage = reference::make_ransac(scene.params, host.host());
    CHECK_THROWS_AS(stage->run({}, {}), StageError);
    (void)run_ransac(*stage, scene);
    RansacScene few = scene;
    few.matches.pop_back();
    CHECK_THROWS_AS((void)run_ransac(*stage, few), StageError);
    scene.params.references = 5000;
    CHECK_THROWS_AS((void)reference::make_ransac(scene.params, host.host()), StageError);
    scene.params.references = 30;
    scene.params.threshold_mm = NAN;
    CHECK_THROWS_AS((void)reference::make_ransac(scene.params, host.host()), StageError);
}
