// Plots of the errors of targets over their depth.
#pragma once

#include <string>

#include "sdk/evaluation/score/target_score.hpp"

namespace defrec::cli {

// Sections of a page; empty where no target has a position.
std::string target_sections(const TargetScore& score);

}  // namespace defrec::cli
