// Follows chosen pixels of the first left image on the template's surface and writes points.csv.
#pragma once

#include <filesystem>
#include <vector>

#include "sdk/cli/program/library.hpp"
#include "sdk/cli/track/frame_projection.hpp"
#include "sdk/cli/track/points.hpp"
#include "sdk/cli/track/track_outputs.hpp"

namespace defrec::cli {

// One thread at a time.
class PointFollower {
  public:
    // Creates the file under its temporary name. Borrows rig and projection.
    PointFollower(const std::filesystem::path& path, std::vector<FollowedPoint> points,
                  const Rig& rig, RawProjection& projection);

    // Finds the surface under the pixels. Before it, and for pixels without surface, every row is
    // lost.
    void lift(const Template& surface);
    // Writes a row for each point and returns them. job is null where the frame has no result to be
    // trusted.
    std::vector<PointRow> add_frame(std::int64_t frame, double timestamp_ms, defrec_job job);
    void commit() { file_.commit(); }

    std::size_t count() const { return points_.size(); }
    // Of all rows written so far.
    std::size_t rows(PointStatus status) const { return rows_[static_cast<std::size_t>(status)]; }
    std::size_t points_without_surface() const;

  private:
    std::vector<FollowedPoint> points_;
    const Rig& rig_;
    RawProjection& projection_;
    PointsFile file_;
    std::vector<double> template_xyz_;  // of the points that were found
    std::vector<std::size_t> place_;    // where in points_ each of them stands
    std::vector<double> xyz_, uv_, errors_, covariances_;
    std::vector<std::uint8_t> status_, evidence_;
    std::size_t rows_[3] = {};
    bool is_lifted_ = false;
};

}  // namespace defrec::cli
