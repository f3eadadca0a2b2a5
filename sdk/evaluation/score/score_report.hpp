// A page with the plots of a score: reliability, coverage and sparsification of points, and the
// errors of targets over their depth. It needs no script and no network.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sdk/evaluation/score/score.hpp"
#include "sdk/evaluation/score/target_score.hpp"

namespace defrec::cli {

// Words before a note that puts all numbers in doubt.
inline constexpr char kDoubt[] = "These numbers probably mean nothing:";

// What was scored of a folder.
struct Scores {
    std::optional<Score> points;
    std::optional<TargetScore> targets;
};

// All notes but those that are doubts.
std::vector<std::string> notes_beside_doubts(const Scores& scores);

// `folder` and `truth` are shown as what was compared.
std::string score_page(const Scores& scores, const std::string& folder, const std::string& truth);

}  // namespace defrec::cli
