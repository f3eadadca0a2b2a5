// registration.json, and what is printed of it.
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "sdk/client/library.hpp"
#include "sdk/registration/program/inputs.hpp"
#include "sdk/registration/program/register_calls.hpp"

namespace defrec::cli {

// All that a run of `defrec register` found.
struct RegisterFindings {
    Registered found;
    std::string reason;  // of the verdict
    std::string method;  // "pairs" or "surface"
    std::vector<std::string> notes;
    std::vector<ModelTarget> targets;
    std::vector<std::int64_t> pair_ids;  // of a registration by pairs
    // The plan's file, and its targets in their order; empty: none was written.
    std::string plan;
    std::vector<std::string> plan_targets;

    void take(Registered registered) {
        found = std::move(registered);
        reason = found.info.reason;
    }
    const defrec_registration_info& info() const { return found.info; }
    bool is_registered() const { return found.is_accepted(); }
};

// "registered", "ambiguous", "undetermined" or "failed".
const char* verdict_of(const defrec_registration_info& info);

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
