// The baseline: OpenCV's StereoSGBM for depth, and pyramidal Lucas-Kanade for points; and the
// control, for which nothing moves.
#pragma once

#include <filesystem>
#include <memory>

#include "sdk/evaluation/data_sets/depth_meter.hpp"
#include "sdk/session/track_session.hpp"

namespace defrec::cli {

// CSV frame,frame_ms: the time of each tracked frame.
inline constexpr char kFrameTimesFile[] = "frame_times.csv";

// The calibration's size is known. Settings and threads are OpenCV's own.
std::unique_ptr<DepthMeter> make_opencv_depth_meter(const StereoCalibration& calibration);
// The control: each frame has the depth of the first one.
std::unique_ptr<DepthMeter> make_still_depth_meter(const StereoCalibration& calibration);

// Follows the points of `options` from image to image of the left view, each with the depth of the
// frame; one that is not found again from the other side within 1 px is lost from then on. Writes
// points.csv and summary.json as `defrec track` does, without expected errors, and the times of the
// frames. Throws CliError.
void track_by_opencv(const TrackOptions& options, const std::filesystem::path& out);
// The control: likewise, but each point stays where the first of its frames with depth has it.
void leave_points(const TrackOptions& options, const std::filesystem::path& out);

}  // namespace defrec::cli
