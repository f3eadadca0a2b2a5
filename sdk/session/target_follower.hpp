// Follows targets beneath the surface and writes targets.csv.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "sdk/client/library.hpp"
#include "sdk/session/frame_projection.hpp"
#include "sdk/session/moved_points.hpp"
#include "sdk/session/targets.hpp"
#include "sdk/session/track_outputs.hpp"

namespace defrec::cli {

// The template's vertices, mm.
std::vector<std::array<float, 3>> vertices_of(const Template& surface);

// One thread at a time.
class TargetFollower {
  public:
    // Creates the file under its temporary name. Borrows the projection.
    TargetFollower(const std::filesystem::path& path, std::vector<Target> targets,
                   RawProjection& projection);

    // The frame that gives the template. Before it every row is lost.
    void prepare(const Template& surface);
    // The template was given up: every row is lost from the next frame on.
    void forget_template() { prepared_.reset(); }
    // Writes a row for each target, and returns them. job is null where the frame has no result to
    // be trusted; every row is then lost.
    std::vector<TargetRow> add_frame(std::int64_t frame, double timestamp_ms, defrec_job job);
    void commit() { file_.commit(); }

    std::size_t count() const { return targets_.size(); }
    const StatusCounts& rows() const { return rows_; }
    // Where they lie beside the template's surface; empty before prepare().
    const TargetPlacesNote& places() const { return places_; }

  private:
    void move(defrec_job job);

    const std::vector<Target> targets_;
    RawProjection& projection_;
    TargetsFile file_;
    std::vector<double> template_xyz_;
    Targets prepared_;
    MovedPoints moved_;
    TargetPlacesNote places_;
    StatusCounts rows_;
};

}  // namespace defrec::cli
