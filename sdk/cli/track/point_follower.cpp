// Follows chosen pixels of the first left image and writes points.csv.
#include "sdk/cli/track/point_follower.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace defrec::cli {

PointFollower::PointFollower(const std::filesystem::path& path, std::vector<FollowedPoint> points,
                             const Rig& rig, RawProjection& projection)
    : points_(std::move(points)), rig_(rig), projection_(projection), file_(path) {}

void PointFollower::lift(const Template& surface) {
    std::vector<double> pixels;
    for (const FollowedPoint& point : points_) pixels.insert(pixels.end(), {point.u, point.v});
    std::vector<double> xyz(3 * points_.size());
    std::vector<std::uint8_t> found(points_.size());
    require(defrec_rig_rectify_pixels(rig_.get(), pixels.data(), points_.size(), pixels.data()),
            ExitCode::kInternal, "rectifying the points to follow");
    require(defrec_template_lift(surface.get(), pixels.data(), points_.size(), xyz.data(),
                                 found.data()),
            ExitCode::kInternal, "finding the surface under the points to follow");
    for (std::size_t i = 0; i < points_.size(); ++i) {
        if (found[i] == 0) continue;
        place_.push_back(i);
        template_xyz_.insert(template_xyz_.end(), xyz.begin() + static_cast<std::ptrdiff_t>(3 * i),
                             xyz.begin() + static_cast<std::ptrdiff_t>(3 * i + 3));
    }
    xyz_.resize(template_xyz_.size());
    uv_.resize(2 * place_.size());
    errors_.resize(place_.size());
    covariances_.resize(6 * place_.size());
    status_.resize(place_.size());
    evidence_.resize(place_.size());
    is_lifted_ = true;
}

std::size_t PointFollower::points_without_surface() const {
    return is_lifted_ ? points_.size() - place_.size() : 0;
}

std::vector<PointRow> PointFollower::add_frame(std::int64_t frame, double timestamp_ms,
                                               defrec_job job) {
    std::vector<PointRow> rows(points_.size());
    for (std::size_t i = 0; i < points_.size(); ++i) {
        rows[i].frame = frame;
        rows[i].timestamp_ms = timestamp_ms;
        rows[i].id = points_[i].id;
    }
    if (job != nullptr && !place_.empty()) {
        require(defrec_job_warp_points(job, template_xyz_.data(), place_.size(), xyz_.data(),
                                       status_.data(), errors_.data()),
                ExitCode::kInternal, "warping the points to follow");
        require(defrec_job_point_covariances(job, template_xyz_.data(), place_.size(),
                                             covariances_.data(), evidence_.data()),
                ExitCode::kInternal, "estimating the errors of the points to follow");
        projection_.project(xyz_.data(), place_.size(), uv_.data());
        for (std::size_t i = 0; i < place_.size(); ++i) {
            const double* xyz = &xyz_[3 * i];
            if (status_[i] == DEFREC_POINT_UNKNOWN || !std::isfinite(xyz[0] + xyz[1] + xyz[2]))
                continue;
            PointRow& row = rows[place_[i]];
            row.status = status_[i] == DEFREC_POINT_OBSERVED ? PointStatus::kTracked
                                                             : PointStatus::kExtrapolated;
            std::copy_n(xyz, 3, row.xyz);
            std::copy_n(&uv_[2 * i], 2, row.uv);
            row.expected_error_mm = errors_[i];
            std::copy_n(&covariances_[6 * i], 6, row.covariance);
            row.evidence = evidence_[i];
        }
    }
    for (const PointRow& row : rows) {
        ++rows_[static_cast<std::size_t>(row.status)];
        file_.add(row);
    }
    return rows;
}

}  // namespace defrec::cli
