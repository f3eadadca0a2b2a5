// Points that a job has moved to its frame, and the rows that the output files have of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sdk/session/frame_projection.hpp"
#include "sdk/session/track_outputs.hpp"

namespace defrec::cli {

// The shapes are those of defrec_job_warp_points() and defrec_job_point_covariances().
struct MovedPoints {
    std::vector<double> xyz, expected_error_mm, covariance;
    std::vector<std::uint8_t> status;
    std::vector<double> uv;  // pixels of the left image as given

    void resize(std::size_t count);
    // Fills uv from xyz.
    void project(RawProjection& projection);
    // Fills all but frame and id from point i. False for a point without a position, whose row it
    // leaves as it is.
    bool fill(std::size_t i, PositionRow& row) const;
};

// How many rows have which status.
class StatusCounts {
  public:
    void add(PointStatus status) { ++rows_[static_cast<std::size_t>(status)]; }
    bool any_position() const {
        return count(PointStatus::kTracked) + count(PointStatus::kExtrapolated) > 0;
    }
    // 0..1; 0 without rows.
    double share(PointStatus status) const;

  private:
    std::size_t count(PointStatus status) const { return rows_[static_cast<std::size_t>(status)]; }

    std::size_t rows_[3] = {};
};

}  // namespace defrec::cli
