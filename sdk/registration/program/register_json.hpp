// registration.json, and what is printed of it.
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "sdk/client/library.hpp"
#include "sdk/registration/program/inputs.hpp"
#include "sdk/registration/program/pairs_and_surface.hpp"
#include "sdk/registration/program/register_calls.hpp"

namespace defrec::cli {

// All that a run of `defrec register` found.
struct RegisterFindings {
    Registered found;
    // By the surface at the same pose, where pairs decided with it; else no handle.
    Registered compared;
    std::uint32_t verdict = DEFREC_VERDICT_FAILED;
    std::string reason;  // of the verdict
    std::string method;  // "pairs", "surface" or "surface and pairs"
    std::vector<std::string> notes;
    std::vector<ModelTarget> targets;
    std::vector<PairFinding> pairs;
    // The plan's file, and its targets in their order; empty: none was written.
    std::string plan;
    std::vector<std::string> plan_targets;

    void take(Registered registered) {
        found = std::move(registered);
        verdict = found.info.verdict;
        reason = found.info.reason;
    }
    const defrec_registration_info& info() const { return found.info; }
    // The one that says how points and model fit.
    const defrec_registration_info& fit() const {
        return (compared.handle ? compared : found).info;
    }
    bool is_registered() const { return verdict == DEFREC_VERDICT_ACCEPTED; }
};

// "registered", "ambiguous", "undetermined" or "failed".
const char* name_of_verdict(std::uint32_t verdict);

// A target in the frame that is seen.
struct MovedTarget {
    std::array<double, 3> place{};
    std::array<double, 6> covariance{};
    double expected_error_mm = 0;
};
MovedTarget moved(const RegisterFindings& findings, const ModelTarget& target);

nlohmann::ordered_json register_json(const RegisterFindings& findings);
// A few lines for people.
std::string register_text(const RegisterFindings& findings);

}  // namespace defrec::cli
