// See map_growth.hpp.
#include "sdk/tracking/map/map_growth.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sdk/base/os/platform.hpp"
#include "sdk/tracking/decisions/template_changes.hpp"

namespace defrec {
namespace {

using Decision = decisions::Growth;

}  // namespace

MapGrowth::MapGrowth(const TrackerSettings& settings)
    : is_on_(settings.grow != 0), max_vertices_(settings.max_vertices) {}

void MapGrowth::reset() {
    begin_anew();
    is_full_ = false;
}

void MapGrowth::begin_anew() {
    if (worker_.joinable()) worker_.join();
    work_ = {};
    keyframe_at_ = due_at_ = not_before_ = pause_ = 0;
    is_keyframe_ = has_earlier_ = false;
}

std::optional<Growth> MapGrowth::begin_frame() {
    if (!is_on_) return std::nullopt;
    ++frame_;
    is_keyframe_ = keyframe_at_ == frame_;
    if (is_keyframe_) keyframe_at_ = 0;
    if (due_at_ == 0 || frame_ < due_at_) return std::nullopt;
    due_at_ = 0;
    worker_.join();
    Growth growth = work_.get();
    if (growth.outcome == Growth::Outcome::kGrown) {
        pause_ = 0;
        return growth;
    }
    is_full_ |= growth.outcome == Growth::Outcome::kFull;
    pause_ = std::clamp<uint64_t>(2 * pause_, 2 * Decision::kBetweenLooks, Decision::kMaxPause);
    not_before_ = frame_ + pause_;
    keyframe_at_ = 0;
    is_keyframe_ = has_earlier_ = false;
    return std::nullopt;
}

bool MapGrowth::rests() const {
    const uint64_t next = frame_ + 1;
    return !is_on_ || (keyframe_at_ != next && (due_at_ == 0 || next < due_at_));
}

void MapGrowth::joined(const TemplateData& data, std::span<const NearestNodes> anchors) {
    if (has_earlier_) extend_motions(data.nodes, anchors, earlier_.motions);
}

void MapGrowth::end_found_frame(const Pipeline& pipeline,
                                const std::shared_ptr<const Template>& surface,
                                const FrameOutput& output) {
    if (!is_on_) return;
    if (is_keyframe_) {
        present_.motions.assign(output.motions.begin(), output.motions.end());
        std::swap(earlier_, present_);  // it is the earlier one when the next comes
        if (std::exchange(has_earlier_, true)) start(pipeline, surface);
        not_before_ = frame_ + Decision::kBetweenLooks;
        keyframe_at_ = not_before_;
        is_keyframe_ = false;
    }
}

void MapGrowth::end_lost_frame() {
    keyframe_at_ = 0;
    is_keyframe_ = has_earlier_ = false;
}

void MapGrowth::plan(const TemplateData& data, const FrameOutput& output) {
    if (!is_on_) return;
    const double uncovered = uncovered_share(data, output);
    const bool has_rested = frame_ >= not_before_ + Decision::kResting;
    const bool wants =
        !is_full_ && (uncovered > Decision::kUncoveredMoving ||
                      (uncovered > Decision::kUncoveredResting && (has_rested || has_earlier_)));
    if (!wants) {
        keyframe_at_ = 0;
        has_earlier_ = false;
    } else if (keyframe_at_ == 0) {
        keyframe_at_ = std::max(frame_ + 1, not_before_);
    }
}

double MapGrowth::uncovered_share(const TemplateData& data, const FrameOutput& output) {
    const double side = Decision::kCell * data.grid.spacing;
    const auto columns = static_cast<size_t>(std::ceil(data.width / side)),
               rows = static_cast<size_t>(std::ceil(data.height / side));
    covered_.assign(columns * rows, 0);
    const defrec_camera& camera = data.camera;
    for (const defrec_surface_sample& sample : output.samples) {
        if (sample.observation == DEFREC_OUTSIDE) continue;
        const float* p = sample.position;
        const auto x = static_cast<size_t>((camera.fx * p[0] / p[2] + camera.cx) / side),
                   y = static_cast<size_t>((camera.fy * p[1] / p[2] + camera.cy) / side);
        covered_[std::min(y, rows - 1) * columns + std::min(x, columns - 1)] = 1;
    }
    const auto uncovered = std::count(covered_.begin(), covered_.end(), 0);
    return static_cast<double>(uncovered) / static_cast<double>(covered_.size());
}

// The work on the two last keyframes: present_ is the earlier of them until the work is done.
void MapGrowth::start(const Pipeline& pipeline, std::shared_ptr<const Template> surface) {
    const uint32_t level = surface->data().texture_level;
    const FoundFrame earlier{pipeline.capture_input(present_.images, level), present_.motions},
        now{pipeline.capture_input(earlier_.images, level), earlier_.motions};
    const auto task = std::make_shared<std::packaged_task<Growth()>>(
        [surface = std::move(surface), earlier, now, max_vertices = max_vertices_] {
            return grow_template(surface->data(), earlier, now, max_vertices);
        });
    worker_ = platform::start_thread([task] { (*task)(); });
    work_ = task->get_future();
    due_at_ = frame_ + Decision::kWorkFrames;
}

}  // namespace defrec
