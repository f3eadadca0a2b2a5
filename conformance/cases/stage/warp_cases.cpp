// Stage warp: by tolerance.
#include <limits>

#include "conformance/cases/stage/stage_case.hpp"
#include "conformance/scenes/template_jobs.hpp"

namespace defrec::conformance {
namespace {

struct Scene {
    test::TestSurface surface;
    defrec_warp_params params;
    std::vector<defrec_motion> motions;
    bool depth = true;
};
using Change = std::function<void(Scene&)>;

void add(std::vector<StageCase>& cases, const char* name, const char* title, const Change& change,
         uint32_t width = 144, uint32_t height = 96, bool smoke = true) {
    const auto make = [=](CaseRun&, uint32_t frame) {
        Scene scene{test_surface(100 + frame, width, height), blank<defrec_warp_params>(), {}};
        scene.motions = loose_motions(scene.surface, 110 + frame);
        if (change) change(scene);
        return warp_job(scene.surface, scene.params, scene.motions, scene.depth);
    };
    cases.push_back(float_case(DEFREC_STAGE_WARP, name, title, make, warp_spread, smoke));
}

// Motions as a fault or an overflow upstream would leave them.
void spoil(std::vector<defrec_motion>& motions) {
    const float nan = std::numeric_limits<float>::quiet_NaN(),
                infinity = std::numeric_limits<float>::infinity();
    motions[3].real[1] = nan;
    motions[7].dual[2] = infinity;
    motions[11] = {};
    motions[15].real[0] = -infinity;
    motions[20].dual[0] = nan;
}

void add_motions(std::vector<StageCase>& cases) {
    add(cases, "not_finite", "Motions that are not finite, or no rotation, count as none.",
        [](Scene& s) { spoil(s.motions); });
    add(cases, "not_unit", "Motions that are not of unit length are made so.", [](Scene& s) {
        for (size_t i = 0; i < s.motions.size(); ++i)
            for (int k = 0; k < 4; ++k) {
                s.motions[i].real[k] *= 1.5f + 0.01f * float(i);
                s.motions[i].dual[k] *= 1.5f + 0.01f * float(i);
            }
    });
    add(cases, "unusual_scale", "Motions far from unit length are made so.",
        [](Scene& s) { scale_motions(s.motions); });
    cases.back().since = 11;
    add(cases, "turned_apart", "Control points turned by 120 degrees, named in any order.",
        [](Scene& s) {
            test::reorder_control_points(s.surface);
            s.motions = test::turned_apart(s.surface);
        });
    cases.back().since = 11;
    add(cases, "opposite_signs", "Quaternions of opposite sign are the same rotation.",
        [](Scene& s) {
            for (size_t i = 0; i < s.motions.size(); i += 2)
                for (int k = 0; k < 4; ++k) {
                    s.motions[i].real[k] = -s.motions[i].real[k];
                    s.motions[i].dual[k] = -s.motions[i].dual[k];
                }
        });
    add(cases, "far_away", "Points outside of the image, behind the camera, and turned away.",
        [](Scene& s) {
            for (size_t i = 0; i < s.motions.size(); ++i) {
                const double turn[] = {0, 0, 1.2, 3.1};
                const Vec3<double> step{i % 5 == 1 ? 200.0 : 3.0, i % 7 == 2 ? -90.0 : 0.5,
                                        i % 3 == 0 ? -170.0 : 10.0};
                s.motions[i] =
                    from_rigid(rotation_from_vector(Vec3<double>{turn[i % 4], 0.1, 0}), step)
                        .store();
            }
        });
}

}  // namespace

void add_warp_cases(std::vector<StageCase>& cases) {
    add(cases, "plain", "Points of a surface, each control point moved on its own.", {});
    add(cases, "identity", "Motions that move nothing.",
        [](Scene& s) { s.motions = s.surface.rest(); });
    add(cases, "no_depth_given", "Without a disparity image no point has depth.",
        [](Scene& s) { s.depth = false; });
    add(cases, "no_valid_depth", "A disparity image without any disparity.", [](Scene& s) {
        s.surface.disparity.assign(s.surface.disparity.size(), int16_t(DEFREC_DISPARITY_NONE));
    });
    add(cases, "holes_and_steps",
        "Holes and steps of disparity, across which nothing is interpolated.", [](Scene& s) {
            Random random(6);
            for (size_t i = 0; i < s.surface.disparity.size(); ++i) {
                if (i / 7 % 5 == 0) s.surface.disparity[i] = int16_t(s.surface.disparity[i] + 40);
                if (random.below(6) == 0)
                    s.surface.disparity[i] =
                        random.below(2) == 0 ? int16_t(DEFREC_DISPARITY_NONE) : int16_t{0};
            }
        });
    add(
        cases, "padded_stride", "Bytes between rows are not looked at.",
        [](Scene& s) { s.params.stride = 171; }, 97, 71);
    add(cases, "converging", "Views that converge: disparities have an offset.",
        [](Scene& s) { converge(s.surface.camera, s.surface.disparity, 11.3); });
    add(cases, "tolerance", "A small tolerance: few points are observed.",
        [](Scene& s) { s.params.tolerance_mm = 0.2f; });
    add_motions(cases);
    add(cases, "camera_size", "A surface of 640 x 480.", {}, 640, 480, false);
}

}  // namespace defrec::conformance
