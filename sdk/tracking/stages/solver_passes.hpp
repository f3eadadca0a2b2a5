// The solver's passes over a frame, coarse to fine.
#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "sdk/tracking/decisions/stages.hpp"
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
    float stiffness;  // of the tracker's arap_weight
    float match_weight;
    float patch_tukey_px;
    float icp_tukey_mm;
};

// The last one is left out where time is short.
inline constexpr std::array<SolverPass, 3> kSolverPasses = {
    SolverPass{
        .time_name = "lm coarse",
        .search = std::nullopt,
        .iterations = nullptr,
        .cg_iterations = decisions::Passes::kCgIterations.coarse,
        .presolve = true,
        .stiffness = decisions::Passes::kStiffness.coarse,
        .match_weight = decisions::Passes::kMatchWeight.coarse,
        .patch_tukey_px = decisions::Passes::kPatchTukey.coarse,
        .icp_tukey_mm = decisions::Passes::kIcpTukey.coarse,
    },
    SolverPass{
        .time_name = "lm middle",
        .search =
            PatchSearch{
                .time_name = "align coarse",
                .level = decisions::Passes::kSearchLevel.middle,
                .radius = decisions::Passes::kSearchRadius.middle,
                .wide_radius = decisions::Passes::kWideRadius.middle,
            },
        .iterations = &TrackerSettings::coarse_iterations,
        .cg_iterations = decisions::Passes::kCgIterations.middle,
        .presolve = false,
        .stiffness = decisions::Passes::kStiffness.middle,
        .match_weight = decisions::Passes::kMatchWeight.middle,
        .patch_tukey_px = decisions::Passes::kPatchTukey.middle,
        .icp_tukey_mm = decisions::Passes::kIcpTukey.middle,
    },
    SolverPass{
        .time_name = "lm fine",
        .search =
            PatchSearch{
                .time_name = "align fine",
                .level = decisions::Passes::kSearchLevel.fine,
                .radius = decisions::Passes::kSearchRadius.fine,
                .wide_radius = decisions::Passes::kWideRadius.fine,
            },
        .iterations = &TrackerSettings::fine_iterations,
        .cg_iterations = decisions::Passes::kCgIterations.fine,
        .presolve = false,
        .stiffness = decisions::Passes::kStiffness.fine,
        .match_weight = decisions::Passes::kMatchWeight.fine,
        .patch_tukey_px = decisions::Passes::kPatchTukey.fine,
        .icp_tukey_mm = decisions::Passes::kIcpTukey.fine,
    },
};

}  // namespace defrec
