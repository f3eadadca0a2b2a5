// Whether a truth fits better where its frames are numbered otherwise: from 1, or from where
// another cut of the recording begins.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <unordered_map>

#include "sdk/evaluation/score/tracked_positions.hpp"

namespace defrec::cli {

struct ShiftLimits {
    static constexpr std::int64_t kMaxShift = 2;  // beside the one that makes both begin together
    static constexpr double kMaxPart = 2.0 / 3;   // of the median as numbered
    // Nothing has been followed yet in the first frame: a tracker that lags fits it as numbered,
    // and a truth that is shifted does not.
    static constexpr double kMinFirst = 1.15;
    static constexpr double kMaxExpected = 5;  // the median, in expected errors
    static constexpr std::size_t kMinPoints = 50, kMinFrames = 3, kMinFirstPoints = 3;
};

// What of a truth can be seen.
using TruePositions = std::unordered_map<FrameAndId, Xyz, FrameAndIdHash>;

struct FrameShift {
    std::int64_t shift = 0;  // the truth's numbers are so much too high
    std::size_t points = 0;  // compared
    double median_mm = 0;
    std::optional<double> numbered_mm;  // the median as numbered; nothing where no frame is common
    bool begins_together = false;       // the first frames of both become one
};

// The shift under which the truth fits clearly better, if there is one.
std::optional<FrameShift> better_shift(const TrackedPositions& tracked, const TruePositions& truth);

// A sentence on it. truth: how its file is named; noun: "point" or "target".
std::string sentence_of(const FrameShift& shift, const std::string& truth, const std::string& noun);

}  // namespace defrec::cli
