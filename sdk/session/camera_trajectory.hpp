// trajectory.txt: where the camera was, in the format of the TUM benchmark (J. Sturm et al., "A
// benchmark for the evaluation of RGB-D SLAM systems", IROS 2012).
#pragma once

#include <filesystem>
#include <string>

#include "include/defrec_c.h"

namespace defrec::cli {

inline constexpr char kTrajectoryFile[] = "trajectory.txt";

// Poses of the left rectified camera in the frame of one template.
class CameraTrajectory {
  public:
    // result: one whose geometry may be shown.
    void add(double timestamp_ms, const defrec_result& result);
    // Lines "time tx ty tz qx qy qz qw", s and m, template from camera; qw is never negative.
    // Throws FileError.
    void write(const std::filesystem::path& path) const;

  private:
    std::string lines_;
};

}  // namespace defrec::cli
