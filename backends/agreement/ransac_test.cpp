// ransac against the reference, and against itself on other numbers of threads.
#include <doctest/doctest.h>

#include <Eigen/Dense>

#include "backends/definition/test_ransac.hpp"
#include "backends/reference/stages.hpp"
#include DEFREC_UNDER_TEST

using namespace defrec;
using namespace defrec::test;

TEST_CASE("weights and motion agree with the reference's") {
    if (!under_test::available()) return;
    for (const uint32_t count : {1u, 7u, 16u, 33u, 300u, 1000u})
        for (const double outliers : {0.0, 0.6, 0.85, 1.0})
            for (const float threshold : {0.0f, 5.0f}) {
                CAPTURE(count);
                CAPTURE(outliers);
                RansacScene scene = make_ransac_scene(count, count, outliers, 35);
                scene.params.threshold_mm = threshold;
                if (count > 10) scene.matches[3].weight = 0;
                const TestHost host(3);
                const RansacResult expected =
                    run_ransac(*reference::make_ransac(scene.params, host.host()), scene);
                const RansacResult got =
                    run_ransac(*under_test::make_ransac(scene.params, host.host()), scene);
                CHECK(got.summary.valid_matches == expected.summary.valid_matches);
                CHECK(got.summary.references == expected.summary.references);
                CHECK(std::abs(got.summary.inliers - expected.summary.inliers) <= 2);
                CHECK(std::abs(got.summary.best_support - expected.summary.best_support) <= 2);
                int different = 0;
                for (size_t i = 0; i < scene.matches.size(); ++i)
                    different +=
                        std::abs(got.matches[i].weight - expected.matches[i].weight) > 1e-3f;
                CHECK(different <= 2);
                for (int k = 0; k < 9; ++k)
                    CHECK(std::abs(got.summary.rotation[k] - expected.summary.rotation[k]) < 1e-3f);
                for (int k = 0; k < 3; ++k)
                    CHECK(std::abs(got.summary.translation[k] - expected.summary.translation[k]) <
                          0.05f);
            }
}

TEST_CASE("no reference has a support beyond the number of matches") {
    if (!under_test::available()) return;
    RansacScene scene = make_ransac_scene(5, 320, 0.2, 20);
    const TestHost host;
    for (const auto make : {reference::make_ransac, under_test::make_ransac})
        for (const uint32_t beyond : {321u, uint32_t{INT32_MAX}, UINT32_MAX - 9, UINT32_MAX}) {
            CAPTURE(beyond);
            scene.params.min_support = beyond;
            const RansacResult result = run_ransac(*make(scene.params, host.host()), scene);
            CHECK(result.summary.valid_matches == 320);
            CHECK(result.summary.references == 0);
            CHECK(result.summary.inliers == 0);
        }
}

TEST_CASE("the number of threads changes no bit") {
    if (!under_test::available()) return;
    const RansacScene scene = make_ransac_scene(3, 500, 0.8, 20);
    const TestHost one(1), four(4);
    const RansacResult a = run_ransac(*under_test::make_ransac(scene.params, one.host()), scene);
    const RansacResult b = run_ransac(*under_test::make_ransac(scene.params, four.host()), scene);
    CHECK(std::memcmp(a.matches.data(), b.matches.data(), a.matches.size() * sizeof a.matches[0]) ==
          0);
    CHECK(std::memcmp(&a.summary, &b.summary, sizeof a.summary) == 0);
}

TEST_CASE("identical points, points on a line and a second run give finite numbers") {
    if (!under_test::available()) return;
    RansacScene scene = make_ransac_scene(9, 30, 0.0, 0);
    const TestHost host;
    const auto stage = under_test::make_ransac(scene.params, host.host());
    for (size_t i = 0; i < 30; ++i)
        for (size_t k = 0; k < 3; ++k)
            scene.landmarks[i].position[k] = scene.matches[i].position[k] = 50;
    CHECK(run_ransac(*stage, scene).summary.inliers == 30);
    for (size_t i = 0; i < 30; ++i)
        scene.landmarks[i].position[0] = scene.matches[i].position[0] = float(i);
    const RansacResult line = run_ransac(*stage, scene);
    CHECK(line.summary.inliers == 30);
    CHECK(determinant(line.summary.rotation) == doctest::Approx(1));
    for (defrec_match& match : scene.matches) match.feature = -1;
    CHECK(run_ransac(*stage, scene).summary.valid_matches == 0);
}
