// Follows chosen pixels and writes points.csv.
#include "sdk/session/point_follower.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/session/decisions.hpp"

namespace defrec::cli {
namespace {

using Decision = decisions::FollowedPoints;

// covariance: xx, xy, xz, yy, yz, zz.
double trace_of(const double* covariance) { return covariance[0] + covariance[3] + covariance[5]; }

}  // namespace

PointFollower::PointFollower(const std::filesystem::path& path, std::vector<FollowedPoint> points,
                             const Rig& rig, RawProjection& projection)
    : points_(std::move(points)), rig_(rig), projection_(projection), file_(path) {}

std::vector<std::size_t> PointFollower::given_in(std::optional<std::int64_t> frame) const {
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < points_.size(); ++i)
        if (points_[i].frame == frame) places.push_back(i);
    return places;
}

std::vector<double> PointFollower::rectified_pixels(const std::vector<std::size_t>& places) const {
    std::vector<double> pixels;
    for (const std::size_t i : places) pixels.insert(pixels.end(), {points_[i].u, points_[i].v});
    require(defrec_rig_rectify_pixels(rig_.get(), pixels.data(), places.size(), pixels.data()),
            ExitCode::kInternal, "rectifying the points to follow");
    return pixels;
}

void PointFollower::note_without_surface(const std::vector<std::size_t>& places,
                                         const std::vector<std::uint8_t>& found) {
    for (std::size_t i = 0; i < places.size(); ++i)
        if (found[i] == DEFREC_FOUND_NONE) without_surface_.push_back(points_[places[i]].id);
}

void PointFollower::keep_found(const std::vector<std::size_t>& places,
                               const std::vector<double>& xyz,
                               const std::vector<std::uint8_t>& found) {
    for (std::size_t i = 0; i < places.size(); ++i) {
        if (found[i] == DEFREC_FOUND_NONE) continue;
        if (found[i] == DEFREC_FOUND_BESIDE) beside_.push_back(place_.size());
        place_.push_back(places[i]);
        template_xyz_.insert(template_xyz_.end(), xyz.begin() + static_cast<std::ptrdiff_t>(3 * i),
                             xyz.begin() + static_cast<std::ptrdiff_t>(3 * i + 3));
    }
    make_room();
}

void PointFollower::make_room() {
    moved_.resize(place_.size());
    evidence_.resize(place_.size());
    lift_covariance_.resize(6 * place_.size());
}

// Leaves points found whose error is small enough, counts the others as of a lost frame, and
// returns the covariances of all.
std::vector<double> PointFollower::judge_lifts(defrec_job job, const std::vector<double>& xyz,
                                               std::vector<std::uint8_t>& found) {
    std::vector<double> covariance(6 * found.size());
    require(defrec_job_point_covariances(job, xyz.data(), found.size(), covariance.data(), nullptr),
            ExitCode::kInternal, "estimating the errors of the points to follow");
    for (std::size_t i = 0; i < found.size(); ++i) {
        const double variance = trace_of(&covariance[6 * i]);
        if (found[i] == DEFREC_FOUND_NONE ||
            variance <= Decision::kMaxLiftError * Decision::kMaxLiftError)
            continue;
        found[i] = DEFREC_FOUND_NONE;
        ++of_lost_frames_;
    }
    return covariance;
}

// The lift's error is about the same in all frames: the tissue turns little.
void PointFollower::add_error_of_lift(std::size_t i, PointRow& row) const {
    const double* covariance = &lift_covariance_[6 * i];
    const double variance = trace_of(covariance);
    if (variance <= 0) return;
    row.expected_error_mm = std::hypot(row.expected_error_mm, std::sqrt(variance));
    for (std::size_t k = 0; k < 6; ++k) row.covariance[k] += covariance[k];
}

void PointFollower::lift(const Template& surface, std::int64_t frame, bool may_grow) {
    std::vector<std::size_t> places = given_in({});
    const std::vector<double> pixels = rectified_pixels(places);
    std::vector<double> xyz(3 * places.size());
    std::vector<std::uint8_t> found(places.size());
    require(
        defrec_template_lift(surface.get(), pixels.data(), places.size(), xyz.data(), found.data()),
        ExitCode::kInternal, "finding the surface under the points to follow");
    if (may_grow) {
        for (std::size_t i = places.size(); i-- > 0;) {
            if (found[i] != 0) continue;
            points_[places[i]].frame = frame;
            const auto at = static_cast<std::ptrdiff_t>(i);
            places.erase(places.begin() + at);
            found.erase(found.begin() + at);
            xyz.erase(xyz.begin() + 3 * at, xyz.begin() + 3 * at + 3);
        }
    }
    note_without_surface(places, found);
    keep_found(places, xyz, found);
}

void PointFollower::begin_at(std::int64_t frame) {
    // Points of a template that was given up had a surface.
    const bool came_too_early = newest_ >= frame && !has_forgotten_;
    for (FollowedPoint& point : points_) {
        if (point.frame) continue;
        point.frame = frame;
        of_lost_frames_ += came_too_early;
    }
}

void PointFollower::forget_template() {
    place_.clear();
    template_xyz_.clear();
    lift_covariance_.clear();
    beside_.clear();
    pieces_.clear();
    without_surface_.clear();
    has_forgotten_ = true;
    make_room();
}

FollowedPoint* PointFollower::chosen(std::int64_t id) {
    const auto found = std::find_if(points_.begin(), points_.end(), [id](const auto& point) {
        return point.id == id && point.is_chosen;
    });
    return found == points_.end() ? nullptr : &*found;
}

void PointFollower::remove(std::int64_t id) {
    const FollowedPoint* point = chosen(id);
    if (point == nullptr) return;
    removed_.push_back(id);
    const auto gone = static_cast<std::size_t>(point - points_.data());
    points_.erase(points_.begin() + static_cast<std::ptrdiff_t>(gone));
    for (std::size_t i = place_.size(); i-- > 0;) {
        if (place_[i] == gone)
            forget_place(i);
        else if (place_[i] > gone)
            --place_[i];
    }
}

void PointFollower::forget_place(std::size_t i) {
    const auto erase = [i](auto& values, std::size_t of_each) {
        const auto begin = values.begin() + static_cast<std::ptrdiff_t>(of_each * i);
        values.erase(begin, begin + static_cast<std::ptrdiff_t>(of_each));
    };
    erase(place_, 1);
    erase(template_xyz_, 3);
    erase(lift_covariance_, 6);
    std::erase(beside_, i);
    for (std::size_t& other : beside_)
        if (other > i) --other;
    pieces_.clear();
    make_room();
}

void PointFollower::rename(std::int64_t id, const std::string& name) {
    if (FollowedPoint* point = chosen(id)) point->name = name;
}

std::int64_t PointFollower::follow(double u, double v, std::int64_t frame) {
    const std::int64_t id = free_id(points_, removed_);
    points_.push_back({id, u, v, frame});
    points_.back().is_click = true;
    return id;
}

void PointFollower::drop_clicks(std::vector<std::size_t>& places, std::vector<double>& xyz,
                                std::vector<std::uint8_t>& found) {
    for (std::size_t i = places.size(); i-- > 0;) {
        if (found[i] != DEFREC_FOUND_NONE || !points_[places[i]].is_click) continue;
        // Whatever else has a place came before the clicks of this frame.
        points_.erase(points_.begin() + static_cast<std::ptrdiff_t>(places[i]));
        for (std::size_t k = i + 1; k < places.size(); ++k) --places[k];
        const auto at = static_cast<std::ptrdiff_t>(i);
        places.erase(places.begin() + at);
        found.erase(found.begin() + at);
        xyz.erase(xyz.begin() + 3 * at, xyz.begin() + 3 * at + 3);
        ++dropped_clicks_;
    }
}

void PointFollower::lift_in(std::int64_t frame, defrec_job job) {
    std::vector<std::size_t> places = given_in(frame);
    if (places.empty()) return;
    std::vector<double> xyz(3 * places.size());
    std::vector<std::uint8_t> found(places.size(), DEFREC_FOUND_NONE);
    if (job == nullptr) {
        drop_clicks(places, xyz, found);
        of_lost_frames_ += places.size();
        return;
    }
    const std::vector<double> pixels = rectified_pixels(places);
    require(defrec_job_lift_points(job, pixels.data(), places.size(), xyz.data(), found.data()),
            ExitCode::kInternal, "finding the surface under the points to follow");
    drop_clicks(places, xyz, found);
    note_without_surface(places, found);
    if (!sure_from_ || frame >= *sure_from_) return keep_found(places, xyz, found);
    const std::size_t before = place_.size();
    const std::vector<double> covariance = judge_lifts(job, xyz, found);
    keep_found(places, xyz, found);
    auto to = lift_covariance_.begin() + static_cast<std::ptrdiff_t>(6 * before);
    for (std::size_t i = 0; i < found.size(); ++i)
        if (found[i] != DEFREC_FOUND_NONE) to = std::copy_n(&covariance[6 * i], 6, to);
}

void PointFollower::settle(defrec_job job) {
    auto result = initialised<defrec_result>();
    require(defrec_job_result(job, &result), ExitCode::kInternal, "reading the result");
    if (std::exchange(template_epoch_, result.template_epoch) == result.template_epoch ||
        beside_.empty())
        return;
    warp(job);
    std::vector<double> xyz(3 * beside_.size()), uv(2 * beside_.size());
    std::vector<std::uint8_t> found(beside_.size());
    for (std::size_t i = 0; i < beside_.size(); ++i)
        std::copy_n(&moved_.xyz[3 * beside_[i]], 3, &xyz[3 * i]);
    projection_.project_rectified(xyz.data(), beside_.size(), uv.data());
    require(defrec_job_lift_points(job, uv.data(), beside_.size(), xyz.data(), found.data()),
            ExitCode::kInternal, "finding the surface under the points to follow");
    std::vector<std::size_t> still_beside;
    for (std::size_t i = 0; i < beside_.size(); ++i)
        if (found[i] == DEFREC_FOUND_SURFACE)
            std::copy_n(&xyz[3 * i], 3, &template_xyz_[3 * beside_[i]]);
        else
            still_beside.push_back(beside_[i]);
    beside_ = std::move(still_beside);
    pieces_.clear();
}

void PointFollower::find_pieces(defrec_job job) {
    if (pieces_.size() == place_.size()) return;
    pieces_.resize(place_.size());
    defrec_template surface = nullptr;
    require(defrec_job_get_template(job, &surface), ExitCode::kInternal, "reading the template");
    const Template owner(surface);
    require(
        defrec_template_point_pieces(surface, template_xyz_.data(), place_.size(), pieces_.data()),
        ExitCode::kInternal, "finding the pieces of the surface that points lie on");
}

void PointFollower::warp(defrec_job job) {
    require(defrec_job_warp_points(job, template_xyz_.data(), place_.size(), moved_.xyz.data(),
                                   moved_.status.data(), moved_.expected_error_mm.data()),
            ExitCode::kInternal, "warping the points to follow");
}

// Points of a frame before the first one, which never comes.
void PointFollower::count_earlier(std::int64_t first) {
    for (const FollowedPoint& point : points_)
        of_lost_frames_ += point.frame.value_or(first) < first;
}

void PointFollower::finish() {
    for (const FollowedPoint& point : points_) {
        if (!point.frame || (newest_ && *point.frame <= *newest_)) continue;
        PointRow row;
        row.frame = *point.frame;
        row.timestamp_ms = std::nan("");
        row.id = point.id;
        rows_.add(row.status);
        file_.add(row);
        ++never_reached_;
    }
}

std::vector<PointRow> PointFollower::add_frame(std::int64_t frame, double timestamp_ms,
                                               defrec_job job) {
    if (!newest_) count_earlier(frame);
    if (job != nullptr) settle(job);
    lift_in(frame, job);
    newest_ = frame;
    std::vector<PointRow> rows(points_.size());
    for (std::size_t i = 0; i < points_.size(); ++i) {
        rows[i].frame = frame;
        rows[i].timestamp_ms = timestamp_ms;
        rows[i].id = points_[i].id;
        rows[i].name = points_[i].name;
        rows[i].is_chosen = points_[i].is_chosen && points_[i].frame.value_or(frame) <= frame;
    }
    if (job != nullptr && !place_.empty()) {
        warp(job);
        require(defrec_job_point_covariances(job, template_xyz_.data(), place_.size(),
                                             moved_.covariance.data(), evidence_.data()),
                ExitCode::kInternal, "estimating the errors of the points to follow");
        find_pieces(job);
        moved_.project(projection_);
        for (std::size_t i = 0; i < place_.size(); ++i) {
            PointRow& row = rows[place_[i]];
            if (!moved_.fill(i, row)) continue;
            add_error_of_lift(i, row);
            row.evidence = evidence_[i];
            row.piece = pieces_[i];
        }
    }
    for (std::size_t i = 0; i < rows.size(); ++i) {
        if (points_[i].frame.value_or(frame) > frame) continue;
        rows_.add(rows[i].status);
        file_.add(rows[i]);
    }
    return rows;
}

}  // namespace defrec::cli
