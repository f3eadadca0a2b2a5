// Follows chosen pixels on the template's surface and writes points.csv.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sdk/client/library.hpp"
#include "sdk/session/frame_projection.hpp"
#include "sdk/session/moved_points.hpp"
#include "sdk/session/points.hpp"
#include "sdk/session/track_outputs.hpp"

namespace defrec::cli {

// One thread at a time.
class PointFollower {
  public:
    // Creates the file under its temporary name. Borrows rig and projection.
    PointFollower(const std::filesystem::path& path, std::vector<FollowedPoint> points,
                  const Rig& rig, RawProjection& projection);

    // Finds the surface under the pixels without a frame: they are of the image that gave the
    // template, in this frame. Before it every row is lost, and of pixels without surface; but if
    // the template may grow, add_frame() lifts them.
    void lift(const Template& surface, std::int64_t frame, bool may_grow);
    // Pixels without a frame are of this one's image, not of that which gave the template.
    void begin_at(std::int64_t frame);
    // The template is of this frame, and frames before it are followed as well, which may show the
    // tissue poorly: the error to be expected where a point is lifted in them stays with the point,
    // and where it is too large the point is lost.
    void follow_back_from(std::int64_t frame) { sure_from_ = frame; }
    // The template was given up: points that were found on it are lost from the next frame on.
    void forget_template();
    // Takes one more pixel, of the frame's image, with the next free id, which it returns. Before
    // add_frame() of that frame, which drops it where there is no surface: it has no rows then.
    std::int64_t follow(double u, double v, std::int64_t frame);
    // A point of the user's, not of the grid, has no more rows, or gets a name; ids of no such
    // point are ignored.
    void remove(std::int64_t id);
    void rename(std::int64_t id, const std::string& name);
    // Finds what lies under the pixels that are given in this frame, and lifts those that lay
    // beside the surface again, onto it, in the first frame in which it reaches them. Writes a row
    // for each point that has been given so far, and returns those of all points. job is
    // null where the frame has no result to be trusted.
    std::vector<PointRow> add_frame(std::int64_t frame, double timestamp_ms, defrec_job job);
    // Points of frames that never came get a row each, of their frame, without time and lost.
    void finish();
    void commit() { file_.commit(); }

    // Pixels of follow() that were dropped.
    std::size_t dropped_clicks() const { return dropped_clicks_; }
    // All that were given, with those that were removed since.
    std::size_t count() const { return points_.size() + removed_.size(); }
    // Points that have a place on the template, which add_frame() follows.
    std::size_t count_on_surface() const { return place_.size(); }
    // Counts of all rows written so far.
    const StatusCounts& rows() const { return rows_; }
    // Points whose frame has come: ids of those of pixels without surface, and how many are of a
    // frame in which the surface was not followed, or not closely. Without those of a template that
    // was given up.
    const std::vector<std::int64_t>& points_without_surface() const { return without_surface_; }
    std::size_t points_of_lost_frames() const { return of_lost_frames_; }
    // Points that were given in a frame behind the last one; after finish().
    std::size_t points_never_reached() const { return never_reached_; }

  private:
    FollowedPoint* chosen(std::int64_t id);  // null: no such point
    // The places in points_ of those given in the frame; none: without a frame.
    std::vector<std::size_t> given_in(std::optional<std::int64_t> frame) const;
    std::vector<double> rectified_pixels(const std::vector<std::size_t>& places) const;
    void note_without_surface(const std::vector<std::size_t>& places,
                              const std::vector<std::uint8_t>& found);
    void keep_found(const std::vector<std::size_t>& places, const std::vector<double>& xyz,
                    const std::vector<std::uint8_t>& found);
    void make_room();
    void forget_place(std::size_t i);
    // Drops clicks without a surface, from what is given as well.
    void drop_clicks(std::vector<std::size_t>& places, std::vector<double>& xyz,
                     std::vector<std::uint8_t>& found);
    std::vector<double> judge_lifts(defrec_job job, const std::vector<double>& xyz,
                                    std::vector<std::uint8_t>& found);
    void add_error_of_lift(std::size_t i, PointRow& row) const;
    void count_earlier(std::int64_t first);
    void lift_in(std::int64_t frame, defrec_job job);
    void settle(defrec_job job);
    // Moves the points from the template frame to the job's frame.
    void warp(defrec_job job);
    // The pieces of the surface that the points lie on, where they are not known yet.
    void find_pieces(defrec_job job);

    std::vector<FollowedPoint> points_;
    std::vector<std::int64_t> removed_;  // ids
    const Rig& rig_;
    RawProjection& projection_;
    PointsFile file_;
    std::vector<double> template_xyz_;  // of the points that were found
    std::vector<std::size_t> place_;    // where in points_ each of them stands
    std::vector<std::size_t> beside_;   // which of them the surface has not reached yet
    std::uint32_t template_epoch_ = 0;  // in which beside_ was looked up
    MovedPoints moved_;
    std::vector<std::uint8_t> evidence_, pieces_;
    std::vector<double> lift_covariance_;  // of the points that were found; 0: of the template
    std::optional<std::int64_t> sure_from_;
    StatusCounts rows_;
    std::vector<std::int64_t> without_surface_;  // ids
    std::size_t of_lost_frames_ = 0, never_reached_ = 0, dropped_clicks_ = 0;
    bool has_forgotten_ = false;          // a template
    std::optional<std::int64_t> newest_;  // frame of the last rows
};

}  // namespace defrec::cli
