// registration.json, and what is printed of it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "sdk/registration/program/inputs.hpp"
#include "sdk/registration/registration.hpp"

namespace defrec::cli {

// All that a run of `defrec register` found.
struct RegisterFindings {
    Registration registration;
    std::string method;  // "pairs" or "surface"
    std::vector<std::string> notes;
    std::vector<ModelTarget> targets;
    std::vector<std::int64_t> pair_ids;  // of a registration by pairs
};

nlohmann::ordered_json register_json(const RegisterFindings& findings);
// A few lines for people.
std::string register_text(const RegisterFindings& findings);

}  // namespace defrec::cli
