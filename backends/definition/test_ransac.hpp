// Scenes for the tests of ransac: points on a bent surface, turned and moved, some of their matches
// wrong.
#pragma once
#include <Eigen/Geometry>
#include <cstring>
#include <random>
#include <vector>

#include "backends/definition/ransac_definition.hpp"
#include "backends/shared/test_host.hpp"

namespace defrec::test {

struct RansacScene {
    defrec_ransac_params params{};
    std::vector<defrec_landmark> landmarks;
    std::vector<defrec_match> matches;
    std::vector<char> right;  // 1: the match is
    Eigen::Matrix3d rotation;
    Eigen::Vector3d translation;
};
struct RansacResult {
    std::vector<defrec_match> matches;
    defrec_ransac_summary summary{};
};

inline double signed_unit(std::mt19937& random) { return double(random()) / 2147483648.0 - 1.0; }

// count matches of which the share `outliers` lands elsewhere on the surface; noise is uniform with
// 0.5 mm standard deviation.
inline RansacScene make_ransac_scene(uint32_t seed, uint32_t count, double outliers,
                                     double degrees) {
    RansacScene scene;
    DEFREC_INIT(&scene.params);
    scene.params.landmarks = count;
    scene.params.threshold_mm = 5;
    scene.params.seed = seed;
    fill_defaults(scene.params);
    std::mt19937 random(seed);
    const auto unit = [&] { return signed_unit(random); };
    const auto surface = [&] {
        const double u = unit(), v = unit();
        return Eigen::Vector3d(45 * u, 26 * v, 80 + 6 * std::sin(2 * u) + 5 * std::cos(2.3 * v));
    };
    const Eigen::Vector3d axis = Eigen::Vector3d(unit(), unit(), unit()).normalized(),
                          centre(0, 0, 80);
    scene.rotation = Eigen::AngleAxisd(degrees * 3.14159265358979 / 180, axis).toRotationMatrix();
    scene.translation =
        centre - scene.rotation * centre + 3 * Eigen::Vector3d(unit(), unit(), unit());
    for (uint32_t i = 0; i < count; ++i) {
        const bool right = (unit() + 1) / 2 >= outliers;
        const Eigen::Vector3d from = surface(), noise(unit(), unit(), unit());
        const Eigen::Vector3d to =
            scene.rotation * (right ? from : surface()) + scene.translation + 0.87 * noise;
        defrec_landmark landmark{};
        defrec_match match{};
        match.weight = 1;
        for (int k = 0; k < 3; ++k) {
            landmark.position[k] = float(from[k]);
            match.position[k] = float(to[k]);
        }
        scene.landmarks.push_back(landmark);
        scene.matches.push_back(match);
        scene.right.push_back(right);
    }
    return scene;
}

inline RansacResult run_ransac(Stage& stage, const RansacScene& scene) {
    const InBuffer prepare[1] = {
        {scene.landmarks.data(), scene.landmarks.size() * sizeof(defrec_landmark)}};
    stage.prepare(prepare);
    RansacResult result;
    result.matches.resize(scene.matches.size());
    const InBuffer in[1] = {{scene.matches.data(), scene.matches.size() * sizeof(defrec_match)}};
    const OutBuffer out[2] = {{result.matches.data(), result.matches.size() * sizeof(defrec_match)},
                              {&result.summary, sizeof result.summary}};
    stage.run(in, out);
    return result;
}

inline double degrees_between(const float rotation[9], const Eigen::Matrix3d& other) {
    Eigen::Matrix3d given;
    for (int i = 0; i < 9; ++i) given(i / 3, i % 3) = double(rotation[i]);
    return Eigen::AngleAxisd(given * other.transpose()).angle() * 180 / 3.14159265358979;
}
inline double determinant(const float rotation[9]) {
    Eigen::Matrix3d given;
    for (int i = 0; i < 9; ++i) given(i / 3, i % 3) = double(rotation[i]);
    return given.determinant();
}

}  // namespace defrec::test
