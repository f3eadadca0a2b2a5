// hand_eye.json, and what is printed of it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "sdk/hand_eye/hand_eye.hpp"

namespace defrec::cli {

nlohmann::ordered_json hand_eye_json(const HandEyeCalibration& calibration);
// A few lines for people.
std::string hand_eye_text(const HandEyeCalibration& calibration);

}  // namespace defrec::cli
