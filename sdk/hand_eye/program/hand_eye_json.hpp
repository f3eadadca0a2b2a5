// hand_eye.json, and what is printed of it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "sdk/client/library.hpp"

namespace defrec::cli {

// The findings of a run of `defrec handeye`; the pointers of info live as long as the handle.
struct HandEyeFindings {
    HandEye hand_eye;
    defrec_hand_eye_info info;
    std::vector<std::string> notes;

    bool is_solved() const { return info.verdict == DEFREC_VERDICT_ACCEPTED; }
};

nlohmann::ordered_json hand_eye_json(const HandEyeFindings& findings);
// A few lines for people.
std::string hand_eye_text(const HandEyeFindings& findings);

}  // namespace defrec::cli
