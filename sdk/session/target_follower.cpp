// Follows targets beneath the surface and writes targets.csv.
#include "sdk/session/target_follower.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace defrec::cli {

std::vector<std::array<float, 3>> vertices_of(const Template& surface) {
    const defrec_template_info info = info_of(surface);
    std::vector<std::array<float, 3>> vertices(info.vertex_count);
    for (std::size_t i = 0; i < vertices.size(); ++i)
        std::copy_n(info.vertices[i].position, 3, vertices[i].begin());
    return vertices;
}

TargetFollower::TargetFollower(const std::filesystem::path& path, std::vector<Target> targets,
                               RawProjection& projection)
    : targets_(std::move(targets)), projection_(projection), file_(path) {
    for (const Target& target : targets_)
        template_xyz_.insert(template_xyz_.end(), target.xyz.begin(), target.xyz.end());
    moved_.resize(targets_.size());
}

void TargetFollower::prepare(const Template& surface) {
    places_ = note_on_places(targets_, vertices_of(surface));
    defrec_targets made = nullptr;
    require(defrec_targets_create(surface.get(), template_xyz_.data(), targets_.size(), &made),
            ExitCode::kInternal, "preparing the targets");
    prepared_.reset(made);
}

void TargetFollower::move(defrec_job job) {
    require(defrec_job_move_targets(job, prepared_.get(), targets_.size(), moved_.xyz.data(),
                                    moved_.covariance.data(), moved_.status.data(),
                                    moved_.expected_error_mm.data()),
            ExitCode::kInternal, "moving the targets");
}

std::vector<TargetRow> TargetFollower::add_frame(std::int64_t frame, double timestamp_ms,
                                                 defrec_job job) {
    if (prepared_ == nullptr) job = nullptr;
    if (job != nullptr) {
        move(job);
        moved_.project(projection_);
    }
    std::vector<TargetRow> rows(targets_.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
        TargetRow& row = rows[i];
        row.frame = frame;
        row.timestamp_ms = timestamp_ms;
        row.id = targets_[i].id;
        row.depth = targets_[i].depth;
        if (job != nullptr) moved_.fill(i, row);
        rows_.add(row.status);
        file_.add(row);
    }
    return rows;
}

}  // namespace defrec::cli
