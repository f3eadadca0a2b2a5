// Pairs and a surface together: what the surface leaves open is decided by the pairs, and where
// they contradict each other, that is the verdict.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "sdk/registration/program/pairs_alone.hpp"
#include "sdk/registration/program/register_calls.hpp"

namespace defrec::cli {

struct SurfaceEvidence {
    std::span<const float> places;  // xyz each, mm
    // Registers by the surface, next to a pose.
    std::function<Registered(const Transform& start)> near;
};

struct Together {
    Registered by_both;     // no handle: the pairs decide nothing
    Registered by_surface;  // where both put the model
    std::string reason;     // of the verdict
    bool is_contradiction = false;
};
// by_surface: from all starts, not failed. pairs: accepted.
Together together(const Registered& by_surface, const SurfaceEvidence& surface,
                  const PairsEvidence& pairs, const RegisterOptions& options);

// How exactly a registration holds each motion that the surface leaves open: "0.35 degrees, 0.2
// mm".
std::string held(const Registered& by_surface, const PairsFile& pairs, const Registered& by);

struct PairFinding {
    std::int64_t id = 0;
    double residual_mm = 0;
    bool fits = false;
};
std::vector<PairFinding> pair_findings(const Registered& found, const PairsEvidence& pairs);

}  // namespace defrec::cli
