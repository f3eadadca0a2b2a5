// How far tracked points are from the truth.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "sdk/evaluation/score/coverage.hpp"
#include "sdk/evaluation/score/error_summary.hpp"
#include "sdk/evaluation/score/score_limits.hpp"
#include "sdk/evaluation/score/scored_rows.hpp"
#include "sdk/evaluation/score/visibility.hpp"

namespace defrec::cli {

// Errors of the points with status tracked, visible or hidden.
struct TrackedErrors {
    static constexpr double kOffMm = 2;
    std::size_t count = 0;
    double max = 0;       // mm
    std::size_t off = 0;  // by more than kOffMm
};

// One group of truth rows. A point counts as lost in a frame where it has no row, no position or
// status lost.
struct ScoreGroup {
    std::string name;  // a state of frames.csv
    std::size_t frames = 0;
    ErrorSummary visible, hidden;    // over points with a position
    std::size_t visible_points = 0;  // rows of the truth
    std::size_t lost_visible = 0;    // of them
    double lost_share() const;       // 0..1; 0 without visible points
    TrackedErrors tracked;
    // Visible and hidden points with a position.
    std::vector<StatusConfidence> statuses;
    StatusConfidence all_statuses;
    Visibility visibility;  // all rows; status tracked says that a point is visible
};

struct Score {
    ScoreGroup all;
    std::vector<ScoreGroup> states;  // in order of first appearance; empty without frames.csv
    SamplesByStatus samples;         // of all states
    std::vector<std::string> notes;  // what speaks against the truth being of these points
    TruthDoubt doubt = {};
    std::size_t not_followed = 0;            // points of the truth
    std::size_t frames_without_visible = 0;  // the share lost does not count these
};

Score score_of(const ScoredRows& scored);

// The score in a sentence.
std::string score_verdict(const Score& score);
std::string score_tables(const Score& score);
nlohmann::ordered_json score_json(const Score& score);

// What exceeds the limits, one message each. Nothing visible to measure exceeds every limit.
std::vector<std::string> exceeded(const Score& score, const ScoreLimits& limits);

}  // namespace defrec::cli
