// The solver's passes over a frame, coarse to fine.
#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "sdk/tracking/frame/tracker_settings.hpp"

namespace defrec {

// Where the surface that the pass before found has its patches, they are searched for.
struct PatchSearch {
    const char* time_name;
    uint32_t level;        // of the image pyramid
    uint32_t radius;       // pixels of that level
    uint32_t wide_radius;  // likewise, of a wide search, which is a level higher in large images
};

// Starts from the motions of the pass before, the first one from those of the frame before.
struct SolverPass {
    const char* time_name;
    std::optional<PatchSearch> search;      // before solving; without, the pass uses no patches
    uint32_t TrackerSettings::*iterations;  // nullptr: one
    uint32_t cg_iterations;                 // of each
    bool presolve;
    // Factor of the tracker's arap_weight. Soft where patches are to be predicted closely enough
    // for the next search to find them: what a stiff surface takes back of a local deformation is
    // lost.
    float stiffness;
    // The paper's while features alone tell where the surface went. Once patches do so to a
    // fraction of a pixel, features, good to about a pixel, only hold what has no patch.
    float match_weight;
    // Wide at first: patches far from the surface so far are what a local deformation looks like.
    float patch_tukey_px;
    // Narrowing: live depth far from the surface is more and more likely an instrument's.
    float icp_tukey_mm;
};

// The last one is left out where time is short.
inline constexpr std::array<SolverPass, 3> kSolverPasses = {
    SolverPass{
        .time_name = "lm coarse",
        .search = std::nullopt,
        .iterations = nullptr,
        .cg_iterations = 5,
        .presolve = true,
        .stiffness = 1,
        .match_weight = 10,
        .patch_tukey_px = 24,
        .icp_tukey_mm = 3,
    },
    SolverPass{
        .time_name = "lm middle",
        .search =
            PatchSearch{
                .time_name = "align coarse",
                .level = 1,
                .radius = 8,
                .wide_radius = 12,
            },
        .iterations = &TrackerSettings::coarse_iterations,
        .cg_iterations = 10,
        .presolve = false,
        .stiffness = 0.2f,
        .match_weight = 1,
        .patch_tukey_px = 24,
        .icp_tukey_mm = 1.5f,
    },
    SolverPass{
        .time_name = "lm fine",
        .search =
            PatchSearch{
                .time_name = "align fine",
                .level = 0,
                .radius = 4,
                .wide_radius = 8,
            },
        .iterations = &TrackerSettings::fine_iterations,
        .cg_iterations = 10,
        .presolve = false,
        .stiffness = 1,
        .match_weight = 0.5f,
        .patch_tukey_px = 8,
        .icp_tukey_mm = 1,
    },
};

}  // namespace defrec
