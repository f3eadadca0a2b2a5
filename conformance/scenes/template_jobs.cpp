// See template_jobs.hpp.
#include "conformance/scenes/template_jobs.hpp"

#include <algorithm>
#include <cmath>

namespace defrec::conformance {
namespace {

template <class Params>
const Params& complete(const StageJob& job) {
    return *static_cast<const Params*>(job.params.get());
}

void random_descriptor(Random& random, uint32_t descriptor[8]) {
    for (int word = 0; word < 8; ++word) descriptor[word] = uint32_t(random.next() >> 32);
}

Input disparity_input(const std::vector<int16_t>& disparity, uint32_t width, uint32_t height,
                      uint32_t stride) {
    return image_input(disparity, width, height, stride);
}

}  // namespace

// ---- match ------------------------------------------------------------------

MatchScene match_scene(uint64_t seed, uint32_t landmarks, uint32_t features, uint32_t width,
                       uint32_t height) {
    MatchScene scene;
    scene.params = blank<defrec_match_params>();
    scene.params.landmarks = landmarks;
    scene.params.features = features;
    scene.params.width = width;
    scene.params.height = height;
    scene.params.camera = {110, 112, width / 2.0 - 0.3, height / 2.0 + 0.6, 4.6, 0};
    scene.count = features;
    Random random(seed);
    for (uint32_t i = 0; i < features; ++i) {
        defrec_feature feature{};
        feature.x = int32_t(random.below(kFeatureOne * width));
        feature.y = int32_t(random.below(kFeatureOne * height));
        random_descriptor(random, feature.descriptor);
        if (i > 0 && random.below(6) ==
                         0) {  // a second level's copy of the corner before, or the same elsewhere
            std::copy_n(scene.features[i - 1].descriptor, 8, feature.descriptor);
            feature.descriptor[3] ^= 1u << random.below(32);
            if (random.below(2) == 0) {
                feature.x = scene.features[i - 1].x + int32_t(random.below(130)) - 65;
                feature.y = scene.features[i - 1].y + int32_t(random.below(130)) - 65;
            }
        }
        scene.features.push_back(feature);
    }
    for (uint32_t i = 0; i < landmarks; ++i) {
        defrec_landmark landmark{};
        random_descriptor(random, landmark.descriptor);
        if (features > 0 && random.below(4) != 0) {
            std::copy_n(scene.features[random.below(features)].descriptor, 8, landmark.descriptor);
            for (uint32_t flips = random.below(80); flips > 0; --flips)
                landmark.descriptor[random.below(8)] ^= 1u << random.below(32);
        }
        for (float& value : landmark.position) value = float(random.within(-30, 80));
        scene.landmarks.push_back(landmark);
    }
    for (uint32_t y = 0; y < height; ++y)
        for (uint32_t x = 0; x < width; ++x) {
            const double wave =
                130 + 20 * std::sin(x / 11.0) + 12 * std::cos(y / 7.0) + (x > width / 2 ? 60 : 0);
            scene.disparity.push_back(random.below(9) == 0 ? int16_t(DEFREC_DISPARITY_NONE)
                                                           : int16_t(wave));
        }
    return scene;
}

StageJob match_job(const MatchScene& scene) {
    StageJob job(DEFREC_STAGE_MATCH, &scene.params);
    const auto& p = complete<defrec_match_params>(job);
    job.prepare = {records(scene.landmarks)};
    job.in = {records(std::vector<uint32_t>{scene.count}), records(scene.features),
              disparity_input(scene.disparity, p.width, p.height, p.stride)};
    job.out = {record_output<defrec_match>("matches", scene.landmarks.size())};
    return job;
}

// ---- align ------------------------------------------------------------------

AlignScene align_scene(const defrec_align_params& params, uint64_t seed, const AlignOptions& o) {
    constexpr double kFocal = 300, kDepth = 80;
    AlignScene scene;
    defrec_align_params& p = scene.params;
    p = params;
    p.width = o.width;
    p.height = o.height;
    p.patches = o.patches;
    p.views = o.views;
    p.nodes = 1;
    const double cx = o.width / 2.0, cy = o.height / 2.0;
    p.camera = {kFocal, kFocal, cx, cy, 4.6, 0};
    const Vec3<double> turn{0, 0, o.angle}, step{0.3, -0.4, kDepth / o.scale - kDepth};
    const auto motion = from_rigid(rotation_from_vector(turn), step);
    scene.motions = {motion.store()};
    for (uint32_t view = 0; view < o.views; ++view)
        scene.views.push_back(texture_picture(o.width, o.height, seed + view, 0, 0, o.noise));
    // The live image: each pixel's ray back to the plane, which is upright.
    scene.live = flat_picture(o.width, o.height, 0);
    const Texture texture(seed);
    Random random(seed + 50);
    const double c = std::cos(-o.angle), s = std::sin(-o.angle), z = kDepth + step.z;
    for (uint32_t y = 0; y < o.height; ++y)
        for (uint32_t x = 0; x < o.width; ++x) {
            const double px = (x - cx) * z / kFocal - step.x, py = (y - cy) * z / kFocal - step.y;
            const double u = cx + kFocal * (c * px - s * py) / kDepth,
                         v = cy + kFocal * (s * px + c * py) / kDepth;
            scene.live.at(x, y) =
                uint8_t(std::clamp(texture.at(u, v) + o.noise * random.normal() + 0.5, 0.0, 255.0));
        }
    scene.mask = holes_mask(o.width, o.height, seed + 51, 15, 9);
    for (uint32_t i = 0; i < o.patches; ++i) {
        defrec_patch patch{};
        patch.u = float(random.within(0, o.width));
        patch.v = float(random.within(0, o.height));
        patch.view = int32_t(random.below(o.views));
        patch.position[0] = float((double(patch.u) - cx) * kDepth / kFocal);
        patch.position[1] = float((double(patch.v) - cy) * kDepth / kFocal);
        patch.position[2] = float(kDepth);
        patch.tangent_u[0] = patch.tangent_v[1] = float(kDepth / kFocal);
        patch.weight[0] = 1;
        scene.patches.push_back(patch);
        const Vec3<double> seen = apply(motion, load3<double>(patch.position));
        const auto error = [&] { return o.prediction_error * random.within(-1, 1); };
        const auto fixed = [](double value, double one) {
            return int32_t(std::floor(value * one + 0.5));
        };
        const double stretch = z / kDepth;
        scene.predictions.push_back(
            {fixed(cx + kFocal * seen.x / seen.z + error(), kPatchOne),
             fixed(cy + kFocal * seen.y / seen.z + error(), kPatchOne),
             {fixed(stretch * c, kPatchMatrixOne), fixed(-stretch * s, kPatchMatrixOne),
              fixed(stretch * s, kPatchMatrixOne), fixed(stretch * c, kPatchMatrixOne)},
             random.below(12) == 0 ? 0 : 1,
             0});
    }
    return scene;
}

StageJob align_job(const AlignScene& scene, int given) {
    StageJob job(DEFREC_STAGE_ALIGN, &scene.params);
    const auto& p = complete<defrec_align_params>(job);
    Input views;
    for (const Gray& view : scene.views) {
        const Input one = picture_input(view, p.stride);
        views.bytes.resize(
            (views.bytes.empty() ? 0 : size_t(p.stride) * p.height * (&view - scene.views.data())));
        views.bytes.insert(views.bytes.end(), one.bytes.begin(), one.bytes.end());
    }
    views.row = p.width;
    views.stride = p.stride;
    job.prepare = {records(scene.patches), views};
    if (scene.slopes.empty())
        job.optional_left_out = 1;
    else
        job.prepare.push_back(records(scene.slopes));
    job.in = {picture_input(scene.live, p.stride),
              (given & align_mask) != 0 ? picture_input(scene.mask, p.stride) : not_given(),
              (given & align_motions) != 0 ? records(scene.motions) : not_given(),
              (given & align_predictions) != 0 ? records(scene.predictions) : not_given()};
    job.out = {record_output<defrec_patch_observation>("observations", scene.patches.size()),
               record_output<defrec_patch_prediction>("predictions", scene.patches.size())};
    job.out[1].given = (given & align_no_prediction_output) == 0;
    return job;
}

// ---- ransac -----------------------------------------------------------------

RansacScene ransac_scene(uint64_t seed, uint32_t count, double outliers, double degrees) {
    RansacScene scene;
    scene.params = blank<defrec_ransac_params>();
    scene.params.landmarks = count;
    scene.params.threshold_mm = 5;
    scene.params.seed = 11;
    Random random(seed);
    const auto surface = [&] {
        const double u = random.within(-1, 1), v = random.within(-1, 1);
        return Vec3<double>{45 * u, 26 * v, 80 + 6 * std::sin(2 * u) + 5 * std::cos(2.3 * v)};
    };
    Vec3<double> axis{random.within(-1, 1), random.within(-1, 1), random.within(-1, 1)};
    axis = (degrees * 3.14159265358979 / 180 / std::sqrt(dot(axis, axis))) * axis;
    const Vec3<double> centre{0, 0, 80},
        step{random.within(-3, 3), random.within(-3, 3), random.within(-3, 3)};
    const auto motion = from_rigid(rotation_from_vector(axis), step);
    for (uint32_t i = 0; i < count; ++i) {
        const Vec3<double> from = surface(), goal = random.unit() >= outliers ? from : surface();
        const Vec3<double> noise{random.within(-0.9, 0.9), random.within(-0.9, 0.9),
                                 random.within(-0.9, 0.9)};
        defrec_landmark landmark{};
        defrec_match match{};
        match.feature = int32_t(i);
        match.distance = int32_t(random.below(64));
        match.second = match.distance + int32_t(random.below(100));
        match.weight = 1;
        store3(from, landmark.position);
        store3(apply(motion, goal - centre) + centre + noise, match.position);
        scene.landmarks.push_back(landmark);
        scene.matches.push_back(match);
    }
    return scene;
}

StageJob ransac_job(const RansacScene& scene) {
    StageJob job(DEFREC_STAGE_RANSAC, &scene.params);
    job.prepare = {records(scene.landmarks)};
    job.in = {records(scene.matches)};
    job.out = {record_output<defrec_match>("matches", scene.matches.size()),
               record_output<defrec_ransac_summary>("summary", 1)};
    return job;
}

// ---- lm, warp ---------------------------------------------------------------

test::TestSurface test_surface(uint64_t seed, uint32_t width, uint32_t height) {
    test::SurfaceSpec spec;
    spec.width = width;
    spec.height = height;
    spec.focal = 1.1 * width;
    spec.node_step = 16;
    spec.point_step =
        4.3;  // points on whole pixels would sit on the borders of every decision about depth
    spec.landmarks = 90;
    spec.patches = 60;
    test::TestSurface surface(spec);
    std::erase_if(surface.points,
                  [&](const defrec_surface_point& point) {  // and these on the image's
                      const auto pixel = surface.project(load3<double>(point.position));
                      return pixel.u < 1 || pixel.v < 1;
                  });
    Random random(seed);
    const double a = random.within(0.4, 0.9), b = random.within(0.3, 0.6),
                 c = random.within(0.8, 1.6);
    surface.deform([=](Vec3<double> p) {
        return Vec3<double>{p.x + a * std::sin(p.y / 12) + 0.5, p.y + b * std::cos(p.x / 14),
                            p.z + c * std::sin(p.x / 16 + p.y / 18)};
    });
    return surface;
}

void converge(defrec_camera& camera, std::vector<int16_t>& disparity, double offset_px) {
    camera.disparity_offset_px = offset_px;
    const auto offset = static_cast<int>(std::lround(double{DEFREC_DISPARITY_ONE} * offset_px));
    for (int16_t& value : disparity)
        if (value > 0)
            value = static_cast<int16_t>(value > offset ? value - offset : DEFREC_DISPARITY_NONE);
}

std::vector<defrec_motion> loose_motions(const test::TestSurface& surface, uint64_t seed,
                                         double turn, double step_mm) {
    Random random(seed);
    std::vector<defrec_motion> motions;
    const auto some = [&](double size) {
        return Vec3<double>{random.within(-size, size), random.within(-size, size),
                            random.within(-size, size)};
    };
    for (size_t i = 0; i < surface.nodes.size() / 3; ++i) {
        const auto rotation = rotation_from_vector(some(turn));
        const Vec3<double> p = load3<double>(&surface.nodes[3 * i]);
        motions.push_back(from_rigid(rotation, p - rotate(rotation, p) + some(step_mm)).store());
    }
    return motions;
}

void scale_motions(std::vector<defrec_motion>& motions) {
    constexpr float kFactors[] = {1, 1e-24f, 1e-30f, 1e25f, 1e30f};
    for (size_t i = 0; i < motions.size(); ++i)
        for (float* part : {motions[i].real, motions[i].dual})
            for (int k = 0; k < 4; ++k) part[k] *= kFactors[i % std::size(kFactors)];
}

StageJob lm_job(const test::TestSurface& surface, defrec_lm_params params,
                const std::vector<defrec_motion>& start, int given) {
    const defrec_lm_params own = surface.lm_params();
    params.struct_size = sizeof params;
    params.nodes = own.nodes;
    params.edges = own.edges;
    params.points = own.points;
    params.landmarks = own.landmarks;
    params.patches = own.patches;
    params.width = own.width;
    params.height = own.height;
    params.camera = own.camera;
    if (params.node_spacing_mm == 0) params.node_spacing_mm = own.node_spacing_mm;
    StageJob job(DEFREC_STAGE_LM, &params);
    const auto& p = complete<defrec_lm_params>(job);
    job.prepare = {records(surface.nodes), records(surface.edges), records(surface.points),
                   records(surface.landmarks), records(surface.patches)};
    job.in = {records(start), (given & lm_matches) != 0 ? records(surface.matches) : not_given(),
              (given & lm_patches) != 0 ? records(surface.observations) : not_given(),
              (given & lm_depth) != 0
                  ? disparity_input(surface.disparity, p.width, p.height, p.stride)
                  : not_given()};
    job.out = {record_output<defrec_motion>("motions", p.nodes),
               record_output<defrec_lm_summary>("summary", 1)};
    return job;
}

StageJob warp_job(const test::TestSurface& surface, defrec_warp_params params,
                  const std::vector<defrec_motion>& motions, bool depth) {
    params.struct_size = sizeof params;
    params.nodes = uint32_t(motions.size());
    params.points = uint32_t(surface.points.size());
    params.width = uint32_t(surface.width());
    params.height = uint32_t(surface.height());
    params.camera = surface.camera;
    StageJob job(DEFREC_STAGE_WARP, &params);
    const auto& p = complete<defrec_warp_params>(job);
    job.prepare = {records(surface.points)};
    job.in = {
        records(motions),
        depth ? disparity_input(surface.disparity, p.width, p.height, p.stride) : not_given()};
    job.out = {record_output<defrec_surface_sample>("samples", p.points)};
    return job;
}

}  // namespace defrec::conformance
