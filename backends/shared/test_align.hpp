// Scenes for the tests of align: a texture known at every real position, seen in a view and, moved
// by an affine map, in a live image.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "backends/shared/record_scales.h"
#include "backends/shared/test_host.hpp"
#include "sdk/contract/stage_params.hpp"

namespace defrec::test {

// A sum of waves of 6 to 60 px in all directions round gray 120.
class Texture {
  public:
    explicit Texture(uint32_t seed) {
        std::mt19937 random(seed);
        double power = 0;
        for (Wave& wave : waves_) {
            const double length = 6 * std::pow(10, unit(random)), angle = 6.2831853 * unit(random);
            wave = {6.2831853 / length * std::cos(angle), 6.2831853 / length * std::sin(angle),
                    6.2831853 * unit(random), std::pow(length, 0.7)};
            power += wave.amplitude * wave.amplitude / 2;
        }
        for (Wave& wave : waves_) wave.amplitude *= 25 / std::sqrt(power);
    }
    double at(double x, double y) const {
        double sum = 120;
        for (const Wave& wave : waves_)
            sum += wave.amplitude * std::cos(wave.x * x + wave.y * y + wave.phase);
        return sum;
    }
    static double unit(std::mt19937& random) { return double(random()) / 4294967296.0; }

  private:
    struct Wave {
        double x, y, phase, amplitude;
    };
    std::array<Wave, 60> waves_;
};

// live position = matrix (view position - centre) + centre + shift.
struct AlignScene {
    defrec_align_params params{};
    std::vector<uint8_t> view, live, mask;
    std::vector<defrec_patch> patches;
    std::vector<defrec_patch_slope> slopes;  // empty: none are given
    std::vector<defrec_patch_prediction> predictions;
    std::vector<std::array<double, 2>> truth;  // px
};
struct AlignSceneOptions {
    uint32_t width = 211, height = 157, stride = 224, level = 0, patch_radius = 5,
             search_radius = 4, seed = 1, patches = 150;
    double angle = 0, scale = 1, shift_x = 1.3, shift_y = -2.6, noise = 1, gain = 1, offset = 0;
    double light = 0;             // its steepest change along x, gray levels in a pixel
    double prediction_error = 2;  // px, of each coordinate
};

inline defrec_align_params align_params(const AlignSceneOptions& o) {
    defrec_align_params p{};
    DEFREC_INIT(&p);
    p.nodes = 1;
    p.width = o.width;
    p.height = o.height;
    p.stride = o.stride;
    p.level = o.level;
    p.patch_radius = o.patch_radius;
    p.search_radius = o.search_radius;
    p.camera = {500, 500, 105, 78, 4.6, 0};
    fill_defaults(p);
    return p;
}

// inverse: of the matrix, row by row.
inline void draw_images(const AlignSceneOptions& o, const double (&inverse)[4],
                        std::mt19937& random, AlignScene& scene) {
    const defrec_align_params& p = scene.params;
    const Texture texture(o.seed);
    const auto noise = [&] {
        return o.noise * 1.73 *
               (Texture::unit(random) + Texture::unit(random) - Texture::unit(random) -
                Texture::unit(random));
    };
    const auto gray = [](double value) {
        return uint8_t(std::clamp(std::floor(value + 0.5), 0.0, 255.0));
    };
    const double cx = o.width / 2.0, cy = o.height / 2.0;
    scene.view.resize(size_t(p.stride) * (p.height - 1) + p.width, 77);
    scene.live.resize(scene.view.size(), 99);
    for (uint32_t y = 0; y < p.height; ++y)
        for (uint32_t x = 0; x < p.width; ++x) {
            const double dx = x - cx - o.shift_x, dy = y - cy - o.shift_y;
            scene.view[size_t(y) * p.stride + x] = gray(texture.at(x, y) + noise());
            scene.live[size_t(y) * p.stride + x] =
                gray(o.gain * texture.at(cx + inverse[0] * dx + inverse[1] * dy,
                                         cy + inverse[2] * dx + inverse[3] * dy) +
                     o.offset + 30 * o.light * std::sin(x / 30.0) + noise());
        }
}

inline AlignScene make_align_scene(const AlignSceneOptions& o) {
    AlignScene scene;
    scene.params = align_params(o);
    std::mt19937 random(o.seed + 1000);
    const double c = o.scale * std::cos(o.angle), s = o.scale * std::sin(o.angle),
                 square = o.scale * o.scale;
    const double inverse[4] = {c / square, s / square, -s / square, c / square};
    draw_images(o, inverse, random, scene);
    const double cx = o.width / 2.0, cy = o.height / 2.0;
    const double margin = double((o.patch_radius + 4) << o.level) * o.scale;
    const auto error = [&] { return o.prediction_error * (2 * Texture::unit(random) - 1); };
    while (scene.patches.size() < o.patches) {
        defrec_patch patch{};
        patch.u = float(margin + (o.width - 2 * margin) * Texture::unit(random));
        patch.v = float(margin + (o.height - 2 * margin) * Texture::unit(random));
        patch.weight[0] = 1;
        const double dx = double(patch.u) - cx, dy = double(patch.v) - cy;
        const double u = cx + o.shift_x + c * dx - s * dy, v = cy + o.shift_y + s * dx + c * dy;
        if (u < margin || v < margin || u > o.width - margin || v > o.height - margin) continue;
        defrec_patch_prediction prediction{int32_t(std::floor((u + error()) * kPatchOne)),
                                           int32_t(std::floor((v + error()) * kPatchOne)),
                                           {},
                                           1,
                                           0};
        for (int k = 0; k < 4; ++k)
            prediction.view_from_live[k] = int32_t(std::floor(inverse[k] * kPatchMatrixOne + 0.5));
        scene.patches.push_back(patch);
        scene.predictions.push_back(prediction);
        scene.truth.push_back({u, v});
    }
    scene.params.patches = uint32_t(scene.patches.size());
    return scene;
}

template <class T>
InBuffer in_buffer(const std::vector<T>& values) {
    return {values.data(), values.size() * sizeof(T)};
}
template <class T>
OutBuffer out_buffer(std::vector<T>& values) {
    return {values.data(), values.size() * sizeof(T)};
}

// Prepares the stage with the scene and runs it on the scene's predictions.
inline std::vector<defrec_patch_observation> observe(Stage& stage, const AlignScene& scene) {
    const InBuffer prepare[2] = {in_buffer(scene.patches), in_buffer(scene.view)};
    stage.prepare(prepare);
    std::vector<defrec_patch_observation> observations(scene.patches.size());
    const InBuffer in[4] = {in_buffer(scene.live),
                            scene.mask.empty() ? InBuffer{} : in_buffer(scene.mask),
                            {},
                            in_buffer(scene.predictions)};
    const OutBuffer out[1] = {out_buffer(observations)};
    stage.run(in, out);
    return observations;
}

}  // namespace defrec::test
