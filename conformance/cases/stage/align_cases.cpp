// Stage align: predictions and information by tolerance, all else exact for the predictions that
// were followed.
#include <algorithm>
#include <cmath>
#include <limits>

#include "conformance/cases/stage/stage_case.hpp"
#include "conformance/scenes/template_jobs.hpp"

namespace defrec::conformance {
namespace {

using Change = std::function<void(AlignScene&)>;

// The same job on the predictions that the device followed.
StageJob with_predictions(StageJob job, const Bytes& predictions) {
    job.in[2] = not_given();
    job.in[3] = records(as<defrec_patch_prediction>(predictions));
    return job;
}

void compare_observations(CaseRun& run, const StageJob& job, const Expected& expected,
                          const std::vector<Bytes>& found) {
    std::vector<bool> information(sizeof(defrec_patch_observation));
    for (size_t byte = offsetof(defrec_patch_observation, information);
         byte < offsetof(defrec_patch_observation, reserved); ++byte)
        information[byte] = true;
    compare_exactly(run, job, 0, expected, found, kObservationFields, information);
    const auto a = as<defrec_patch_observation>(expected.outputs[0]),
               b = as<defrec_patch_observation>(found[0]);
    Distances apart("align.information");
    for (size_t i = 0; i < a.size(); ++i)
        for (int k = 0; k < 3; ++k)
            apart.add(double(a[i].information[k]), double(b[i].information[k]));
    apart.measure(run);
}

void compare(CaseRun& run, const StageJob& job, const Expected& expected,
             const std::vector<Bytes>& found) {
    if (!job.out[1].given) return compare_observations(run, job, expected, found);
    if (job.in[3].given) {
        compare_exactly(run, job, 1, expected, found, kPredictionFields);
        return compare_observations(run, job, expected, found);
    }
    Spread distances;
    align_spread(job, expected.outputs, found, distances);
    distances.measure(run);
    if (expected.outputs[1] == found[1]) return compare_observations(run, job, expected, found);
    const StageJob followed = with_predictions(job, found[1]);
    compare_observations(run, followed, run_reference(run.reference(), followed), found);
}

// A scene and what of it the stage is given, in bits of align_*.
struct Setup {
    defrec_align_params params;
    AlignOptions options;
    int given;
};

void add(std::vector<StageCase>& cases, const char* name, const char* title, const Setup& setup,
         const Change& change = {}, bool smoke = true) {
    const int given = setup.given;
    const auto make = [=](CaseRun&, uint32_t frame) {
        AlignScene scene = align_scene(setup.params, 200 + frame, setup.options);
        if (change) change(scene);
        return align_job(scene, given);
    };
    const SpreadOf spread =
        (given & align_motions) != 0 && (given & align_no_prediction_output) == 0 ? align_spread
                                                                                  : nullptr;
    cases.push_back({DEFREC_STAGE_ALIGN, name, title, make, compare, smoke, false, {}, spread});
}

defrec_align_params base() { return blank<defrec_align_params>(); }

// Five control points, four to a patch with weights of different sizes, and patches of two.
void move_each_on_its_own(AlignScene& s) {
    s.params.nodes = 5;
    const auto moved = [](double turn, double x, double y) {
        return from_rigid(rotation_from_vector(Vec3<double>{0.1 * turn, -0.1 * turn, 0.05 + turn}),
                          {x, y, 0})
            .store();
    };
    s.motions = {s.motions[0], moved(0.05, 2, 0), moved(-0.1, 0, -2), moved(0.02, -1, 1),
                 moved(0.15, 1, 2)};
    for (float* part : {s.motions[2].real, s.motions[2].dual})
        for (int k = 0; k < 4; ++k) part[k] = -part[k];
    constexpr float kWeights[3][4] = {
        {0.4f, 0.3f, 0.2f, 0.1f}, {0.6f, 0.4f, 0, 0}, {0.25f, 0.25f, 0.25f, 0.25f}};
    for (size_t i = 0; i < s.patches.size(); ++i)
        for (size_t k = 0; k < 4; ++k) {
            s.patches[i].node[k] = int32_t((i + k) % 5);
            s.patches[i].weight[k] = kWeights[i % 3][k];
        }
}

// Weights of such control points that change across the patches, so that these are strained.
void strain(AlignScene& s) {
    move_each_on_its_own(s);
    constexpr float kSlopes[2][4] = {{-0.02f, 0.015f, -0.01f, 0.015f},
                                     {0.025f, 0, -0.02f, -0.005f}};
    for (size_t i = 0; i < s.patches.size(); ++i) {
        defrec_patch_slope slope{};
        for (size_t k = 0; k < 4; ++k) {
            slope.weight_u[k] = kSlopes[i % 2][k];
            slope.weight_v[k] = kSlopes[(i + 1) % 2][k];
        }
        s.slopes.push_back(slope);
    }
}

// Light that changes across the image and its patches.
void light(AlignScene& s) {
    for (uint32_t y = 0; y < s.params.height; ++y)
        for (uint32_t x = 0; x < s.params.width; ++x) {
            uint8_t& gray = s.live.at(x, y);
            const double lit = 0.7 * gray + 40 + 25 * std::sin(x / 11.0) + 20 * std::cos(y / 9.0);
            gray = uint8_t(std::clamp(std::floor(lit + 0.5), 0.0, 255.0));
        }
}

void add_inputs(std::vector<StageCase>& cases) {
    add(cases, "motions", "Patches predicted from motions and found.", {base(), {}, align_motions});
    add(cases, "predictions", "Given predictions are followed.", {base(), {}, align_predictions});
    add(cases, "both", "Given predictions are followed though there are motions too.",
        {base(), {.prediction_error = 3}, align_motions | align_predictions}, [](AlignScene& s) {
            s.motions[0] =
                from_rigid(rotation_from_vector(Vec3<double>{0, 0, 0.2}), {1, 1, 0}).store();
        });
    add(cases, "mask", "Masked pixels take no part.", {base(), {}, align_predictions | align_mask});
    add(cases, "mask_motions", "Masked pixels take no part, with motions.",
        {base(), {}, align_motions | align_mask});
    add(cases, "observations_alone", "The result is the same if predictions are not asked for.",
        {base(), {}, align_predictions | align_mask | align_no_prediction_output});
    add(cases, "views", "Patches of several views.", {base(), {.views = 3}, align_predictions});
    add(cases, "no_patches", "A template without patches after one with.",
        {base(), {.patches = 0}, align_predictions});
    add(cases, "fewer_patches",
        "As many patches as prepare was given, fewer than the parameters say.",
        {base(), {.patches = 17}, align_predictions},
        [](AlignScene& s) { s.params.patches = 300; });
}

void add_images(std::vector<StageCase>& cases) {
    for (const auto& [name, title, value] :
         {std::tuple{"flat", "A flat live image: nothing is found.", 90},
          {"white", "A saturated live image.", 255}})
        add(cases, name, title, {base(), {}, align_predictions}, [value = value](AlignScene& s) {
            s.live = flat_picture(s.live.width, s.live.height, uint8_t(value));
        });
    add(cases, "flat_view", "Patches without texture.", {base(), {}, align_predictions},
        [](AlignScene& s) { s.views[0] = flat_picture(s.live.width, s.live.height, 70); });
    add(cases, "noise", "A live image of nothing but noise.", {base(), {}, align_predictions},
        [](AlignScene& s) { s.live = random_picture(s.live.width, s.live.height, 4); });
    add(cases, "extremes", "Images of black and white alone.",
        {base(), {.angle = 0, .scale = 1, .noise = 0}, align_predictions}, [](AlignScene& s) {
            for (Gray* picture : {&s.live, &s.views[0]})
                for (uint8_t& pixel : picture->pixels) pixel = pixel > 120 ? 255 : 0;
        });
}

void add_motions(std::vector<StageCase>& cases) {
    add(cases, "senseless_predictions",
        "Predictions anywhere, turned and stretched out of all proportion.",
        {base(), {.patches = 120}, align_predictions}, [](AlignScene& s) {
            Random random(8);
            for (defrec_patch_prediction& one : s.predictions) {
                one.valid = random.below(9) == 0 ? 7 : 1;
                one.u = int32_t(random.below(s.params.width * 300)) - 3000;
                one.v = int32_t(random.below(s.params.height * 300)) - 3000;
                for (int32_t& entry : one.view_from_live)
                    entry = int32_t(random.below(11 * kPatchMatrixOne)) - 5 * kPatchMatrixOne;
                if (random.below(10) == 0) one.u = random.below(2) == 0 ? INT32_MIN : INT32_MAX;
                if (random.below(10) == 0)
                    one.view_from_live[random.below(4)] =
                        random.below(2) == 0 ? INT32_MIN : INT32_MAX;
            }
        });
    add(cases, "not_finite", "Motions that are not finite predict nothing.",
        {base(), {}, align_motions}, [](AlignScene& s) {
            s.params.nodes = 3;
            const float nan = std::numeric_limits<float>::quiet_NaN();
            s.motions = {s.motions[0], s.motions[0], s.motions[0]};
            s.motions[1].real[2] = nan;
            s.motions[2].dual[1] = std::numeric_limits<float>::infinity();
            for (size_t i = 0; i < s.patches.size(); ++i) s.patches[i].node[0] = int32_t(i % 3);
        });
    add(cases, "blended_motions",
        "Patches that several control points move, each in its own way, some with the opposite "
        "sign.",
        {base(), {}, align_motions}, move_each_on_its_own);
    add(cases, "slopes", "Patches that are strained, since their weights change across them.",
        {base(), {}, align_motions}, strain);
    add(cases, "light", "Light that changes across patches.",
        {base(), {}, align_motions | align_mask}, light);
    defrec_align_params right = base();
    right.right_view = 1;
    add(cases, "right_view", "Patches predicted into the right view, and found there.",
        {right, {}, align_motions | align_mask}, [](AlignScene& s) {
            const Vec3<double> baseline{s.params.camera.baseline_mm, 0, 0};
            s.motions[0] = compose(from_rigid(Quaternion<double>{1, 0, 0, 0}, baseline),
                                   DualQuaternion<double>::load(s.motions[0]))
                               .store();
        });
    add(cases, "right_view_converging",
        "Patches predicted into a right view that converges with the left one.",
        {right, {}, align_motions | align_mask}, [](AlignScene& s) {
            defrec_camera& camera = s.params.camera;
            camera.disparity_offset_px =
                camera.fx * camera.baseline_mm / double(s.patches[0].position[2]);
        });
    add(cases, "behind", "Patches behind the camera, and turned away.", {base(), {}, align_motions},
        [](AlignScene& s) {
            s.motions[0] =
                from_rigid(rotation_from_vector(Vec3<double>{2.9, 0, 0}), {0, 0, -60}).store();
        });
}

void add_parameters(std::vector<StageCase>& cases) {
    defrec_align_params params = base();
    params.stride = 101;
    add(cases, "padded_stride", "Bytes between rows are not looked at.",
        {params, {.width = 97, .height = 71, .views = 2}, align_predictions | align_mask});
    add(cases, "smallest", "The smallest image.",
        {base(), {.width = 64, .height = 48, .patches = 60}, align_predictions | align_mask});
    for (const uint32_t level : {1u, 2u, 3u}) {
        params = base();
        params.level = level;
        params.patch_radius = level == 3 ? 2 : 3;
        static constexpr const char* kNames[] = {"", "level_1", "level_2", "level_3"};
        add(cases, kNames[level], "Searching on images that are halved.",
            {params,
             {.width = 163, .height = 129, .patches = 60},
             align_predictions | (level == 2 ? 0 : int(align_mask))});
    }
    params = base();
    params.patch_radius = 1;
    params.search_radius = 1;
    params.min_score = 400;
    params.texture = 1;
    add(cases, "small_radii", "The smallest patches and searches.",
        {params, {.prediction_error = 0.5}, align_predictions | align_mask});
    params.patch_radius = 7;
    params.search_radius = 16;
    add(cases, "large_radii", "The largest patches and searches.",
        {params, {.patches = 16, .prediction_error = 8}, align_predictions | align_mask});
    for (const uint32_t level : {0u, 1u}) {
        params = base();
        params.level = level;
        params.patch_radius = 7 - 2 * level;
        params.min_score = 1 + 1500 * level;
        params.keep_predicted = 1;
        add(cases, level == 0 ? "keep_predicted" : "keep_predicted_level_1",
            "Patches that are not found are compared where they are predicted.",
            {params,
             {.width = 163, .height = 129, .prediction_error = 4.5},
             align_predictions | align_mask});
    }
    params = base();
    params.min_score = 4000;
    params.texture = 200;
    add(cases, "strict", "A high score and much texture asked for.",
        {params, {}, align_predictions});
    params = base();
    params.search_radius = 8;
    add(cases, "camera_size", "Patches of a 640 x 480 image.",
        {params,
         {.width = 640, .height = 480, .patches = 500, .prediction_error = 5},
         align_motions | align_mask},
        {}, false);
}

}  // namespace

void add_align_cases(std::vector<StageCase>& cases) {
    add_inputs(cases);
    add_images(cases);
    add_motions(cases);
    add_parameters(cases);
}

}  // namespace defrec::conformance
