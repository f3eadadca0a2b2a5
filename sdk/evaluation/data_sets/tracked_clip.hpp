// A clip that is tracked, and what its files say of the time and the frames.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "sdk/evaluation/data_sets/data_set.hpp"
#include "sdk/session/track_session.hpp"

namespace defrec::cli {

// By the task's method. Source, calibration and points of the clip are set; leaves points.csv,
// summary.json and frames.csv, by OpenCV frame_times.csv, in task.out. Throws CliError also where
// the source ended early.
void track_clip(const ClipTask& task, TrackOptions options);

// Time of all stages together in each frame, ms.
std::vector<double> frame_times_in(const std::filesystem::path& out);
// Sets the score's frames and their times.
void set_times(const std::filesystem::path& out, ClipScore& score);

// "degraded (few-matches)", by frames.csv; empty for OpenCV, which has no states.
std::string state_of(const std::filesystem::path& out, std::int64_t frame);

// A point in an image: where it is, and where it was found.
struct MarkedPoint {
    double true_u = 0, true_v = 0;    // px
    double found_u = 0, found_v = 0;  // NaN where it was not found
};

// The left image of a frame as JPEG, at most 480 px wide: a green ring at each true position and a
// line from it to where the point was found; a red ring where it was not.
std::string picture_of(const SourceOptions& source, std::int64_t frame,
                       const std::vector<MarkedPoint>& points);

}  // namespace defrec::cli
