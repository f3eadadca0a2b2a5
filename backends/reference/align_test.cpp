// Tests of the definition of align: how exact positions are, what is found and what is not.
#include <doctest/doctest.h>

#include "backends/reference/stages.hpp"
#include "backends/shared/motion.hpp"
#include "backends/shared/test_align.hpp"

using namespace defrec;
using namespace defrec::test;

namespace {

struct Accuracy {
    double found = 0, rms = 0, bias_x = 0;  // share; px over both coordinates
};
Accuracy accuracy(const AlignScene& scene) {
    const TestHost host;
    const auto observations = observe(*reference::make_align(scene.params, host.host()), scene);
    Accuracy out;
    double squares = 0, count = 0;
    for (size_t i = 0; i < observations.size(); ++i) {
        if (observations[i].valid == 0) continue;
        const double x = observations[i].u / 256.0 - scene.truth[i][0],
                     y = observations[i].v / 256.0 - scene.truth[i][1];
        squares += x * x + y * y;
        out.bias_x += x;
        count += 1;
    }
    out.found = count / double(observations.size());
    out.rms = std::sqrt(squares / count);
    out.bias_x /= count;
    return out;
}

// One patch in the middle of a live image that draw paints; the view is the same image.
AlignScene picture(uint8_t (*draw)(int x, int y)) {
    AlignSceneOptions options;
    options.patches = 1;
    AlignScene scene = make_align_scene(options);
    const defrec_align_params& p = scene.params;
    for (uint32_t y = 0; y < p.height; ++y)
        for (uint32_t x = 0; x < p.width; ++x)
            scene.view[size_t(y) * p.stride + x] = draw(int(x), int(y));
    scene.live = scene.view;
    scene.patches[0].u = 100.25f;
    scene.patches[0].v = 80.5f;
    scene.predictions[0] = {100 * 256 + 192, 80 * 256, {65536, 0, 0, 65536}, 1, 0};
    return scene;
}
defrec_patch_observation observe_one(const AlignScene& scene) {
    const TestHost host;
    return observe(*reference::make_align(scene.params, host.host()), scene)[0];
}

// The predictions from the motions of the control points.
std::vector<defrec_patch_prediction> predict(const AlignScene& scene,
                                             const std::vector<defrec_motion>& motions) {
    const TestHost host;
    const auto stage = reference::make_align(scene.params, host.host());
    const InBuffer prepare[3] = {in_buffer(scene.patches), in_buffer(scene.view),
                                 in_buffer(scene.slopes)};
    stage->prepare(prepare);
    std::vector<defrec_patch_observation> observations(scene.patches.size());
    std::vector<defrec_patch_prediction> predictions(scene.patches.size());
    const InBuffer in[3] = {in_buffer(scene.live), {}, in_buffer(motions)};
    const OutBuffer out[2] = {out_buffer(observations), out_buffer(predictions)};
    stage->run(in, out);
    return predictions;
}

}  // namespace

TEST_CASE(
    "positions are exact to a tenth of a pixel under shift, rotation, scale, gain and noise") {
    for (const uint32_t level : {0u, 1u})
        for (const double angle : {0.0, 0.3})
            for (const double scale : {0.9, 1.0, 1.15}) {
                CAPTURE(level);
                CAPTURE(angle);
                CAPTURE(scale);
                AlignSceneOptions options;
                options.level = level;
                options.angle = angle;
                options.scale = scale;
                options.gain = 0.8;
                options.offset = 15;
                options.prediction_error = level == 0 ? 2 : 5;
                const Accuracy a = accuracy(make_align_scene(options));
                CHECK(a.found > 0.97);
                CHECK(a.rms < 0.1);
            }
}

TEST_CASE("light that changes across patches neither hides nor moves them") {
    AlignSceneOptions options;
    options.light = 1.5;
    const Accuracy a = accuracy(make_align_scene(options));
    CHECK(a.found > 0.85);
    CHECK(a.rms < 0.2);
}

TEST_CASE("positions are not drawn towards whole pixels") {
    for (const double shift : {0.0, 0.25, 0.5, 0.75}) {
        AlignSceneOptions options;
        options.shift_x = shift;
        options.shift_y = 0;
        options.noise = 0;
        const Accuracy a = accuracy(make_align_scene(options));
        CHECK(a.rms < 0.06);
        CHECK(std::abs(a.bias_x) < 0.02);
    }
}

TEST_CASE("a patch farther away than the search radius is not found where it is not") {
    AlignSceneOptions options;
    options.prediction_error = 0;
    AlignScene scene = make_align_scene(options);
    for (defrec_patch_prediction& prediction : scene.predictions) prediction.u += 20 * 256;
    CHECK(accuracy(scene).found < 0.1);
}

TEST_CASE("what is not found is kept where it is predicted if asked for, and fits there") {
    AlignSceneOptions options;
    options.prediction_error = 0;
    AlignScene scene = make_align_scene(options);
    // Smooth: a window's peak is out of reach, and hardly higher than where it is predicted.
    const auto smooth = [](double x, double y) {
        return uint8_t(std::lround(120 + 50 * std::sin(x / 14) + 50 * std::cos(y / 17)));
    };
    for (uint32_t y = 0; y < scene.params.height; ++y)
        for (uint32_t x = 0; x < scene.params.width; ++x) {
            const size_t at = size_t(y) * scene.params.stride + x;
            scene.view[at] = smooth(x, y);
            scene.live[at] = smooth(x + 5, y + 5);
        }
    for (size_t i = 0; i < scene.patches.size(); ++i) {
        scene.predictions[i].u = int32_t(std::lround(256.0 * double(scene.patches[i].u)));
        scene.predictions[i].v = int32_t(std::lround(256.0 * double(scene.patches[i].v)));
        const int32_t straight[4] = {kPatchMatrixOne, 0, 0, kPatchMatrixOne};
        std::copy_n(straight, 4, scene.predictions[i].view_from_live);
    }
    const auto kept_from = [&](uint32_t keep, uint32_t min_score) {
        scene.params.keep_predicted = keep;
        scene.params.min_score = min_score;
        size_t kept = 0;
        const auto observations =
            observe(*reference::make_align(scene.params, TestHost().host()), scene);
        for (size_t i = 0; i < observations.size(); ++i) {
            const defrec_patch_observation& o = observations[i];
            if (o.valid == 0 || o.information[0] != 0 || o.information[2] != 0) continue;
            CHECK(o.u == scene.predictions[i].u);
            CHECK(o.v == scene.predictions[i].v);
            CHECK(o.score >= int32_t(min_score));
            ++kept;
        }
        return kept;
    };
    CHECK(kept_from(0, 1) == 0);
    const size_t kept = kept_from(1, 1);
    CHECK(kept > scene.patches.size() / 4);
    CHECK(kept_from(1, 4096) < kept);
}

TEST_CASE("row 61: masked pixels do not count, and too few usable ones are no observation") {
    AlignSceneOptions options;
    AlignScene scene = make_align_scene(options);
    const Accuracy clean = accuracy(scene);
    scene.mask.assign(scene.live.size(), 255);
    std::mt19937 random(3);
    // Highlights of 3x3 px; masks grow round them (stage rectify), as interpolation reaches two
    // pixels far.
    for (int k = 0; k < 40; ++k) {
        const size_t x = random() % (scene.params.width - 7),
                     y = random() % (scene.params.height - 7);
        for (size_t j = 0; j < 7; ++j)
            for (size_t i = 0; i < 7; ++i) {
                const size_t at = (y + j) * scene.params.stride + x + i;
                scene.mask[at] = 0;
                if (i >= 2 && i < 5 && j >= 2 && j < 5) scene.live[at] = 255;
            }
    }
    AlignScene unmasked = scene;
    unmasked.mask.clear();
    CHECK(accuracy(unmasked).rms > 2 * clean.rms);
    const Accuracy masked = accuracy(scene);
    CHECK(masked.found > 0.75);
    CHECK(masked.rms < 1.3 * clean.rms);
    scene.mask.assign(scene.live.size(), 0);
    for (const defrec_patch_observation& o :
         observe(*reference::make_align(scene.params, TestHost().host()), scene))
        CHECK(o.valid == 0);
}

TEST_CASE("row 62: without texture nothing is found") {
    const defrec_patch_observation o = observe_one(picture([](int, int) { return uint8_t(90); }));
    CHECK(o.valid == 0);
    CHECK(o.information[0] == 0);
}

TEST_CASE("a straight edge locates across itself only, and stays at the prediction along itself") {
    const AlignScene scene = picture([](int x, int) {
        return uint8_t(x < 98 ? 60 : x > 104 ? 180 : 60 + (x - 98) * 20);
    });
    const defrec_patch_observation o = observe_one(scene);
    REQUIRE(o.valid == 1);
    CHECK(o.u / 256.0 == doctest::Approx(100.25).epsilon(0.0005));
    CHECK(o.v == scene.predictions[0].v);
    CHECK(o.information[0] > 0.9f);
    CHECK(o.information[2] < 0.01f);
}

TEST_CASE("a patch that leaves its view, or a prediction that is senseless, is not found") {
    AlignSceneOptions options;
    options.patches = 6;
    AlignScene scene = make_align_scene(options);
    scene.patches[0].u = 3;
    scene.patches[1].v = NAN;
    scene.predictions[2].u = INT32_MAX;
    scene.predictions[3].view_from_live[1] = INT32_MIN;
    scene.predictions[4].valid = 0;
    const auto observations =
        observe(*reference::make_align(scene.params, TestHost().host()), scene);
    for (size_t i = 0; i < 5; ++i) CHECK(observations[i].valid == 0);
    CHECK(observations[5].valid == 1);
}

TEST_CASE(
    "a prediction is the projection of the moved patch, into the right view too, and the "
    "derivative of the projection") {
    AlignSceneOptions options;
    options.patches = 3;
    AlignScene scene = make_align_scene(options);
    const double turn[9] = {0.96, -0.28, 0, 0.28, 0.96, 0, 0, 0, 1}, step[3] = {1, 0.5, -4};
    const auto motion = from_rigid(turn, step);
    for (defrec_patch& patch : scene.patches) {
        patch.position[0] = 2;
        patch.position[1] = -1;
        patch.position[2] = 80;
        patch.tangent_u[0] = patch.tangent_v[1] = 80.0f / 500.0f;
        patch.tangent_u[2] = 0.03f;
    }
    scene.patches[1].position[0] = 500;
    scene.patches[2].position[2] = -80;
    for (const uint32_t right_view : {0u, 1u}) {
        CAPTURE(right_view);
        scene.params.right_view = right_view;
        const auto predictions = predict(scene, {motion.store()});
        const auto project = [&](Vec3<double> p) {
            const Vec3<double> x = apply(motion, p);
            return std::array<double, 2>{500 * (x.x - (right_view != 0 ? 4.6 : 0)) / x.z + 105,
                                         500 * x.y / x.z + 78};
        };
        const Vec3<double> p = load3<double>(scene.patches[0].position),
                           tu = load3<double>(scene.patches[0].tangent_u),
                           tv = load3<double>(scene.patches[0].tangent_v);
        REQUIRE(predictions[0].valid == 1);
        CHECK(std::abs(predictions[0].u / 256.0 - project(p)[0]) < 0.003);
        CHECK(std::abs(predictions[0].v / 256.0 - project(p)[1]) < 0.003);
        const double e = 1e-4;
        double j[4];
        for (size_t k = 0; k < 2; ++k) {
            j[2 * k] = (project(p + e * tu)[k] - project(p - e * tu)[k]) / (2 * e);
            j[2 * k + 1] = (project(p + e * tv)[k] - project(p - e * tv)[k]) / (2 * e);
        }
        const int32_t* m = predictions[0].view_from_live;
        CHECK(m[0] * j[0] + m[1] * j[2] == doctest::Approx(65536).epsilon(1e-3));
        CHECK(std::abs(m[0] * j[1] + m[1] * j[3]) < 20);
        CHECK(std::abs(m[2] * j[0] + m[3] * j[2]) < 20);
        CHECK(m[2] * j[1] + m[3] * j[3] == doctest::Approx(65536).epsilon(1e-3));
        CHECK(predictions[1].valid == 0);
        CHECK(predictions[2].valid == 0);
    }
}

TEST_CASE("with slopes of the weights, the derivative has the strain between control points") {
    AlignSceneOptions options;
    options.patches = 1;
    AlignScene scene = make_align_scene(options);
    scene.params.nodes = 4;
    defrec_patch& patch = scene.patches[0];
    patch.position[2] = 80;
    patch.tangent_u[0] = patch.tangent_v[1] = 80.0f / 500.0f;
    // Bilinear in a cell of 30 px, the patch a third and a fifth from its first corner.
    constexpr double kCell = 30, kU = 1.0 / 3, kV = 0.2;
    const auto weights = [](double u, double v) {
        return std::array<double, 4>{(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
    };
    const auto at = [&](double u, double v) { return weights(kU + u / kCell, kV + v / kCell); };
    defrec_patch_slope slope;
    for (int k = 0; k < 4; ++k) {
        const auto slot = static_cast<size_t>(k);
        patch.node[k] = k;
        patch.weight[k] = float(at(0, 0)[slot]);
        slope.weight_u[k] = float((at(1, 0)[slot] - at(-1, 0)[slot]) / 2);
        slope.weight_v[k] = float((at(0, 1)[slot] - at(0, -1)[slot]) / 2);
    }
    scene.slopes = {slope};
    std::vector<defrec_motion> motions;
    constexpr double kSteps[4][3] = {{0, 0, 0}, {-1, 0.3, 0.5}, {0.2, 0.8, -0.4}, {-0.7, 1, 1}};
    for (const auto& step : kSteps)
        motions.push_back(
            from_rigid(Quaternion<double>{1, 0, 0, 0}, Vec3<double>{step[0], step[1], step[2]})
                .store());
    // Translations blend to their weighted mean.
    const auto project = [&](double u, double v) {
        std::array<double, 3> p = {u * 80 / 500, v * 80 / 500, 80};
        const auto w = at(u, v);
        for (size_t k = 0; k < 4; ++k)
            for (size_t axis = 0; axis < 3; ++axis) p[axis] += w[k] * kSteps[k][axis];
        return std::array<double, 2>{500 * p[0] / p[2], 500 * p[1] / p[2]};
    };
    const auto predictions = predict(scene, motions);
    REQUIRE(predictions[0].valid == 1);
    const double e = 1e-3;
    double j[4];
    for (size_t k = 0; k < 2; ++k) {
        j[2 * k] = (project(e, 0)[k] - project(-e, 0)[k]) / (2 * e);
        j[2 * k + 1] = (project(0, e)[k] - project(0, -e)[k]) / (2 * e);
    }
    const int32_t* m = predictions[0].view_from_live;
    CHECK(m[0] * j[0] + m[1] * j[2] == doctest::Approx(65536).epsilon(1e-3));
    CHECK(std::abs(m[0] * j[1] + m[1] * j[3]) < 20);
    CHECK(std::abs(m[2] * j[0] + m[3] * j[2]) < 20);
    CHECK(m[2] * j[1] + m[3] * j[3] == doctest::Approx(65536).epsilon(1e-3));
    // It is strained by a fifth across.
    CHECK(j[0] < 0.85);
}

TEST_CASE("bad parameters and buffers are refused") {
    const TestHost host;
    AlignScene scene = make_align_scene({});
    const auto refused = [&](auto change) {
        defrec_align_params params = scene.params;
        change(params);
        CHECK_THROWS_AS((void)reference::make_align(params, host.host()), StageError);
    };
    refused([](defrec_align_params& p) { p.level = 4; });
    refused([](defrec_align_params& p) { p.patch_radius = 8; });
    refused([](defrec_align_params& p) { p.search_radius = 17; });
    refused([](defrec_align_params& p) { p.right_view = 2; });
    refused([](defrec_align_params& p) { p.keep_predicted = 2; });
    const auto stage = reference::make_align(scene.params, host.host());
    CHECK_THROWS_AS(stage->run({}, {}), StageError);
    const std::vector<uint8_t> few(scene.view.size() - 1);
    const InBuffer small[2] = {in_buffer(scene.patches), in_buffer(few)};
    CHECK_THROWS_AS(stage->prepare(small), StageError);
    scene.patches[3].node[2] = 1;
    const InBuffer wrong[2] = {in_buffer(scene.patches), in_buffer(scene.view)};
    CHECK_THROWS_AS(stage->prepare(wrong), StageError);
}

TEST_CASE("no patches at all are no error") {
    AlignScene scene = make_align_scene({});
    scene.patches.clear();
    scene.predictions.clear();
    scene.params.patches = 0;
    CHECK(observe(*reference::make_align(scene.params, TestHost().host()), scene).empty());
}
