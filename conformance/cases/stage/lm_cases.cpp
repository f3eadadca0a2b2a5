// Stage lm: by tolerance of what it finds, never of its path.
#include <limits>

#include "conformance/cases/stage/stage_case.hpp"
#include "conformance/scenes/template_jobs.hpp"

namespace defrec::conformance {
namespace {

struct Scene {
    test::TestSurface surface;
    defrec_lm_params params;
    std::vector<defrec_motion> start;
    int given = lm_everything;
};
using Change = std::function<void(Scene&)>;

void add(std::vector<StageCase>& cases, const char* name, const char* title,
         const Change& change = {}, uint32_t width = 144, uint32_t height = 96, bool smoke = true) {
    const auto make = [=](CaseRun&, uint32_t frame) {
        Scene scene{test_surface(400 + frame, width, height), blank<defrec_lm_params>(), {}};
        scene.start = scene.surface.rest();
        if (change) change(scene);
        return lm_job(scene.surface, scene.params, scene.start, scene.given);
    };
    cases.push_back(float_case(DEFREC_STAGE_LM, name, title, make, lm_spread, smoke));
}

void spoil_matches(test::TestSurface& surface) {
    Random random(9);
    for (defrec_match& match : surface.matches) {
        if (random.below(3) != 0) continue;
        for (float& value : match.position) value += float(random.within(-20, 20));
        match.weight = random.below(2) == 0 ? 0.0f : 0.9f;
    }
}

// The control points and all that they move as two pieces, side by side: no connection and no
// weight leads from one to the other.
void part_in_two(Scene& s) {
    test::TestSurface& surface = s.surface;
    const auto is_right = [&](int32_t node) {
        return surface.nodes[3 * static_cast<size_t>(node)] > 0;
    };
    std::erase_if(surface.edges,
                  [&](const defrec_edge& edge) { return is_right(edge.a) != is_right(edge.b); });
    const auto part = [&](auto& items) {
        for (auto& item : items) {
            const bool side = is_right(item.node[0]);
            for (int k = 1; k < DEFREC_BLEND_NODES; ++k) {
                if (is_right(item.node[k]) == side) continue;
                item.weight[0] += item.weight[k];
                item.weight[k] = 0;
                item.node[k] = item.node[0];
            }
        }
    };
    part(surface.points);
    part(surface.landmarks);
    part(surface.patches);
}

void add_terms(std::vector<StageCase>& cases) {
    add(cases, "everything", "Depth, matches and patches together.");
    add(cases, "matches_alone", "Matches alone.", [](Scene& s) { s.given = lm_matches; });
    add(cases, "patches_alone", "Patch observations alone.",
        [](Scene& s) { s.given = lm_patches; });
    add(cases, "depth_alone", "Depth alone.", [](Scene& s) { s.given = lm_depth; });
    add(cases, "converging", "Views that converge: disparities have an offset.", [](Scene& s) {
        converge(s.surface.camera, s.surface.disparity, 11.3);
        s.given = lm_depth;
    });
    add(cases, "no_data", "Without data the motions stay as they were.", [](Scene& s) {
        s.given = 0;
        s.start = loose_motions(s.surface, 1);
    });
    add(cases, "outliers", "Some matches are wrong, weighted or not.",
        [](Scene& s) { spoil_matches(s.surface); });
    add(cases, "all_outliers", "Every match is far off.", [](Scene& s) {
        for (defrec_match& match : s.surface.matches) match.position[0] += 60;
    });
    add(cases, "all_outliers_7mm", "Every match is beyond a kernel of 7 mm.", [](Scene& s) {
        s.given = lm_matches;
        s.params.match_tukey_mm = 7;
        for (size_t i = 0; i < s.surface.matches.size(); ++i) {
            s.surface.matches[i].position[0] += 60;
            if (i % 3 == 0) s.surface.matches[i].weight = 0;
        }
    });
    cases.back().since = 11;
    add(cases, "patches_60px_off_no_depth", "Every patch is seen far from where it can be.",
        [](Scene& s) {
            s.given = lm_patches;
            for (defrec_patch_observation& observation : s.surface.observations)
                observation.u += kPatchOne * 60;
        });
    cases.back().since = 11;
    add(cases, "hidden", "A third of the image shows nothing.",
        [](Scene& s) { s.surface.hide([](double u, double) { return u > 90; }); });
    add(cases, "pieces", "Two pieces of a surface, which nothing connects.", part_in_two);
    add(cases, "no_valid_depth", "A disparity image without any disparity.", [](Scene& s) {
        s.surface.disparity.assign(s.surface.disparity.size(), int16_t(DEFREC_DISPARITY_NONE));
    });
    add(cases, "information", "Patches known along one direction only, or not at all.",
        [](Scene& s) {
            for (size_t i = 0; i < s.surface.observations.size(); ++i) {
                float* information = s.surface.observations[i].information;
                const float kinds[4][3] = {
                    {1, 0, 0}, {0.5f, 0.5f, 0.5f}, {0, 0, 0}, {0.3f, -0.1f, 2.5f}};
                std::copy_n(kinds[i % 4], 3, information);
            }
        });
}

// Only so many preselected matches are left, moved far, so that a rigid start shows.
void keep_preselected(Scene& s, int count) {
    s.params.presolve = 1;
    s.given = lm_matches;
    for (defrec_match& match : s.surface.matches) {
        if (!(match.weight > 0) || count-- <= 0) match = {};
        match.position[0] += 7;
    }
}

// By patches to where the image shows no surface, which costs more than they gain.
void lead_off_the_surface(Scene& s) {
    s.given = lm_patches | lm_depth;
    for (defrec_patch_observation& observation : s.surface.observations)
        observation.u += kPatchOne * 60;
    s.params.patch_tukey_px = 1000;
    s.params.icp_weight = 300;
}

void add_solvers(std::vector<StageCase>& cases) {
    add(cases, "independent", "Every control point by itself.",
        [](Scene& s) { s.params.solver = DEFREC_SOLVER_INDEPENDENT; });
    add(cases, "presolve", "Everything is moved rigidly onto the matches first.", [](Scene& s) {
        s.params.presolve = 1;
        for (defrec_match& match : s.surface.matches) match.position[0] += 7;
        s.given = lm_matches;
    });
    add(cases, "independent_presolve", "The independent solver after a rigid start.", [](Scene& s) {
        s.params.solver = DEFREC_SOLVER_INDEPENDENT;
        s.params.presolve = 1;
        spoil_matches(s.surface);
    });
    add(cases, "presolve_few", "One match too few for a rigid start.",
        [](Scene& s) { keep_preselected(s, 19); });
    add(cases, "presolve_enough", "Just enough matches for a rigid start.",
        [](Scene& s) { keep_preselected(s, 20); });
    add(cases, "one_iteration", "A single step.", [](Scene& s) { s.params.iterations = 1; });
    add(cases, "trusted_step", "Two steps, of which the last one is trusted.", [](Scene& s) {
        s.params.iterations = 2;
        s.params.trust_last_step = 1;
    });
    add(cases, "trusted_rise", "A trusted step that raises the cost.", [](Scene& s) {
        lead_off_the_surface(s);
        s.params.iterations = 1;
        s.params.trust_last_step = 1;
    });
    add(cases, "refused_before_trusted", "No step is trusted after one that was refused.",
        [](Scene& s) {
            lead_off_the_surface(s);
            s.params.iterations = 2;
            s.params.trust_last_step = 1;
        });
    add(cases, "few_cg_iterations", "Three steps of conjugate gradients in each.",
        [](Scene& s) { s.params.cg_iterations = 3; });
    add(cases, "started_near", "A start near the solution, as from the frame before.",
        [](Scene& s) {
            s.start = loose_motions(s.surface, 3, 0.01, 0.1);
            s.params.iterations = 4;
        });
    add(cases, "large_damping", "A large first damping.", [](Scene& s) { s.params.damping = 10; });
}

defrec_match next_to_no_depth(float depth) {
    defrec_match match{};
    match.position[0] = 10;
    match.position[1] = 5;
    match.position[2] = depth;
    match.weight = 1;
    return match;
}

void add_parameters(std::vector<StageCase>& cases) {
    add(cases, "weights", "Other weights of the terms.", [](Scene& s) {
        s.params.icp_weight = 3;
        s.params.match_weight = 4;
        s.params.patch_weight = 2;
        s.params.arap_weight = 0.3f;
    });
    add(cases, "stiffness", "Other weights of the smoothness term's parts.", [](Scene& s) {
        s.params.length_weight = 5;
        s.params.angle_weight = 3;
        s.params.rotation_weight = 20;
        s.params.node_spacing_mm = 8;
    });
    add(cases, "kernels", "Narrow kernels, and a short association.", [](Scene& s) {
        s.params.icp_tukey_mm = 1;
        s.params.match_tukey_mm = 1.5f;
        s.params.patch_tukey_px = 2;
        s.params.association_mm = 3;
        s.params.match_threshold_mm = 0.7f;
        spoil_matches(s.surface);
    });
    add(
        cases, "padded_stride", "Bytes between rows are not looked at.",
        [](Scene& s) { s.params.stride = 131; }, 97, 71);
    add(cases, "camera_size", "A surface of 480 x 360.", {}, 480, 360, false);
    add(cases, "not_finite", "Motions, matches and observations that are not finite are left out.",
        [](Scene& s) {
            const float nan = std::numeric_limits<float>::quiet_NaN(),
                        infinity = std::numeric_limits<float>::infinity();
            s.start[2].real[0] = nan;
            s.start[5].dual[3] = infinity;
            s.start[9] = {};
            s.surface.matches[4].position[1] = nan;
            s.surface.matches[8].position[2] = infinity;
            s.surface.matches[11].weight = nan;
            // No direction, and one that leads out of everything.
            s.surface.matches[14] = next_to_no_depth(1e-38f);
            s.surface.matches[15] = next_to_no_depth(1e-30f);
            s.surface.observations[3].information[0] = nan;
            s.surface.observations[6].information[2] = infinity;
        });
    add(cases, "unusual_scale", "Motions and information far from 1 in size.", [](Scene& s) {
        s.start = loose_motions(s.surface, 5, 0.01, 0.1);
        scale_motions(s.start);
        const float kinds[4][3] = {
            {1e30f, 0, 1}, {3e38f, 0, 3e38f}, {1e20f, 5e19f, 1e20f}, {1, 0, 1}};
        for (size_t i = 0; i < s.surface.observations.size(); ++i)
            std::copy_n(kinds[i % 4], 3, s.surface.observations[i].information);
    });
    cases.back().since = 11;
    add(cases, "turned_apart", "Control points turned by 120 degrees, named in any order.",
        [](Scene& s) {
            test::reorder_control_points(s.surface);
            s.start = test::turned_apart(s.surface);
            s.given = lm_matches | lm_patches;
            s.params.match_tukey_mm = 200;
            s.params.patch_tukey_px = 2000;
            s.params.iterations = 1;
        });
    cases.back().since = 11;
}

}  // namespace

void add_lm_cases(std::vector<StageCase>& cases) {
    add_terms(cases);
    add_solvers(cases);
    add_parameters(cases);
}

}  // namespace defrec::conformance
