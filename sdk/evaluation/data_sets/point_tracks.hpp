// Points of a clip that are tracked, in the left camera and image as the data set gives them.
#pragma once

#include <limits>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "sdk/evaluation/data_sets/data_set.hpp"
#include "sdk/evaluation/data_sets/tracked_clip.hpp"
#include "sdk/session/points.hpp"

namespace defrec::cli {

inline constexpr double kNoPlace = std::numeric_limits<double>::quiet_NaN();

struct FoundPoint {
    cv::Point3d mm{kNoPlace, kNoPlace, kNoPlace};  // left camera as given
    cv::Point2d px{kNoPlace, kNoPlace};            // left image as given
    bool is_tracked = false;                       // else extrapolated or lost
    bool has_place() const { return mm.z > 0; }
};

struct PointClip {
    SourceOptions source;
    StereoCalibration calibration;
    std::vector<cv::Point2d> points;  // px of the first left image as given
};

class PointTracks {
  public:
    // Tracks the clip's points by the task's method; leaves what track_clip() leaves in task.out,
    // and calibration.yaml and followed.csv. Throws CliError.
    PointTracks(const ClipTask& task, const PointClip& clip);

    // Frames first() to last() were tracked; numbers are those of the source.
    std::int64_t first() const { return first_; }
    std::int64_t last() const { return first_ + static_cast<std::int64_t>(frames_.size()) - 1; }
    const FoundPoint& at(std::int64_t frame, std::size_t point) const {
        return frames_.at(static_cast<std::size_t>(frame - first_)).at(point);
    }
    // In this frame, else in the last one before it; without a place where there is none.
    FoundPoint last_known(std::int64_t frame, std::size_t point) const;

  private:
    std::int64_t first_;
    std::vector<std::vector<FoundPoint>> frames_;
};

// The clip's calibration as a file that load_calibration() reads.
void write_calibration(const std::filesystem::path& path, const StereoCalibration& calibration);

// [x, y] and [x, y, z] as text that gives the same numbers back.
std::string json_of(const cv::Point2d& point);
std::string json_of(const cv::Point3d& point);

}  // namespace defrec::cli
