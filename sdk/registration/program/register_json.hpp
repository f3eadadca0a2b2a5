// registration.json, and what is printed of it.
#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "sdk/client/library.hpp"
#include "sdk/registration/program/inputs.hpp"

namespace defrec::cli {

// All that a run of `defrec register` found; the pointers of info live as long as the handle.
struct RegisterFindings {
    Registration registration;
    defrec_registration_info info{};
    std::string method;  // "pairs" or "surface"
    std::vector<std::string> notes;
    std::vector<ModelTarget> targets;
    std::vector<std::int64_t> pair_ids;  // of a registration by pairs
    // The plan's file, and its targets in their order; empty: none was written.
    std::string plan;
    std::vector<std::string> plan_targets;

    bool is_registered() const { return info.verdict == DEFREC_VERDICT_ACCEPTED; }
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
