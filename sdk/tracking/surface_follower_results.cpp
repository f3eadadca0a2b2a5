// Results of class SurfaceFollower: what is measured of what the device gave, the frame's state,
// and what it tells of the surface. Which frames come so far: surface_follower.cpp.
#include <algorithm>
#include <atomic>
#include <numeric>

#include "sdk/tracking/evidence/vertex_runs.hpp"
#include "sdk/tracking/map/piece_search.hpp"
#include "sdk/tracking/stages/check_output.hpp"
#include "sdk/tracking/surface_follower.hpp"

namespace defrec {
namespace {

constexpr size_t kPatchRun = 256;   // patches that one thread measures
constexpr size_t kRecordParts = 4;  // of what the stages gave, each checked by one thread
constexpr float kFastMm = 5;        // of motion from frame to frame

// Frame coordinates of the control points.
void place_nodes(const TemplateData& data, std::span<const defrec_motion> motions, TrackerJob& job,
                 ArrayPart part = {}) {
    for (size_t i = part.begin(motions.size()); i < part.end(motions.size()); ++i)
        store3(node_position(data.nodes, motions, i), &job.node_positions[3 * i]);
}

}  // namespace

// What measuring needs and does not wait for the device.
void SurfaceFollower::begin_measuring(TrackerJob& job) {
    const TemplateData& data = template_->data();
    const size_t runs = vertex_runs(job.output.samples.size());
    vertex_evidence_.resize(runs);
    rigid_sums_.resize(runs);
    fast_vertices_.assign(runs, 0);
    patch_px2_.resize(data.patches.size());
    job.lateral.make_room(data);
    begin_confidence(last_->model, job.confidence);
    row_matches_.reserve(rig_patch_count(data));
    rows_.reserve(rig_patch_count(data));
    rig_after_ = rig_monitor_;
    disparities_after_ = disparities_;
    disparities_after_.make_room();
}

// Checks what the stages gave, and works out what follows from it alone, in tasks that other
// threads share: this is most of what the host does while the application waits. What is wrong
// leads to results that nobody sees, and to no undefined operation.
void SurfaceFollower::measure(TrackerJob& job) {
    const TemplateData& data = template_->data();
    const std::span<const defrec_surface_sample> samples = job.output.samples;
    const size_t runs = vertex_runs(samples.size());
    std::atomic<bool> is_wrong = false;
    const std::span<double> patches(patch_px2_);
    const size_t patch_runs = std::max<size_t>(1, (patches.size() + kPatchRun - 1) / kPatchRun);
    std::atomic<size_t> patch_runs_left = patch_runs, sums_left = 2;
    const auto measure_patch_run = [&](size_t run) {
        const size_t first = run * kPatchRun;
        measure_patches(data, job.output, first,
                        patches.subspan(first, std::min(kPatchRun, patches.size() - first)));
        if (--patch_runs_left != 0) return;
        spread_patches(data, patch_px2_, job.lateral);
        --sums_left;
    };
    const auto sum_checks = [&] {
        spread_checks(data, job.output, job.lateral);
        --sums_left;
    };
    const auto measure_rig = [&] {
        if (!watches_rig_) return;
        match_rows(data, job.output, last_rows_, rows_, row_matches_);
        rig_left_after_ = rig_after_.update(row_matches_);
    };
    const auto check_records = [&](ArrayPart part) {
        if (pipeline_.any_wrong_record(job.output, data, part)) is_wrong = true;
        place_nodes(data, job.output.motions, job, part);
    };
    const auto check_run = [&](size_t run) {
        if (any_wrong_sample(vertex_run(samples, run))) is_wrong = true;
        vertex_evidence_[run] = weigh_vertices(vertex_run(samples, run));
        if (is_tracking_)
            fast_vertices_[run] = count_moved_farther(
                vertex_run(SurfaceSamples(last_->samples), run), vertex_run(samples, run), kFastMm);
    };
    const auto sum_run = [&](size_t run) {
        const size_t first = run * kVertexRun;
        wait_for([&] { return sums_left == 0; });  // those that add them up have begun
        measure_lateral(data, job.output, first, std::min(first + kVertexRun, samples.size()),
                        job.lateral);
    };
    const std::shared_ptr<const Services> services = job.services();
    for_tasks_and_runs(
        services->own_threads(), patch_runs + 3 + kRecordParts,
        [&](size_t task) {  // first those for whose sums the runs wait
            if (task < patch_runs) return measure_patch_run(task);
            if (task == patch_runs) return sum_checks();
            if (task == patch_runs + 1) return measure_rig();
            if (task > patch_runs + 2) return check_records({task - patch_runs - 3, kRecordParts});
            if (watches_rig_) disparities_after_.add_frame(data, samples);
        },
        runs,
        [&](size_t run) {
            check_run(run);
            measure_run(job, run);
            sum_run(run);
        });
    if (is_wrong) pipeline_.check(job.output, data);
}

void SurfaceFollower::measure_run(TrackerJob& job, size_t run) {
    const size_t first = run * kVertexRun;
    const SurfaceSamples samples = vertex_run(SurfaceSamples(job.output.samples), run);
    rigid_sums_[run] = sum_for_rigid_motion(last_->model, samples, first);
    const auto of_run = [&](std::vector<float>& values) {
        return std::span(values).subspan(3 * first, 3 * samples.size());
    };
    split_samples(samples, of_run(job.vertices), of_run(job.normals));
}

void SurfaceFollower::conclude(TrackerJob& job, const Verdict& verdict, bool uses_depth) {
    const PieceEvidences pieces = verdict.found
                                      ? weigh_pieces(template_->data(), template_->vertex_pieces(),
                                                     job.output, job.evidence, patch_px2_)
                                      : PieceEvidences{};
    const bool is_found = verdict.found && pieces_.shows_any(pieces, uses_depth);
    const bool sees_depth =
        uses_depth && !job.is_interlaced() && chosen_ && chosen_->effort == Effort::kFull;
    if (is_found) {
        const size_t fast =
            std::accumulate(fast_vertices_.begin(), fast_vertices_.end(), size_t{0});
        if (is_tracking_ && 2 * fast >= job.output.samples.size())
            job.reasons |= DEFREC_REASON_FAST_MOTION;
        job.state = !is_tracking_      ? DEFREC_RELOCALISED
                    : verdict.degraded ? DEFREC_DEGRADED
                                       : DEFREC_TRACKING;
        if (!is_tracking_) ++epoch_;
        std::copy(job.output.motions.begin(), job.output.motions.end(), last_->motions.begin());
        age_ = 0;
        pieces_.end_frame(job.state, pieces, uses_depth);
        if (pieces_.misses_one()) {
            job.reasons |= DEFREC_REASON_PIECE_LOST;
            if (job.state == DEFREC_TRACKING) job.state = DEFREC_DEGRADED;
            search_lost_pieces(job);
        }
        may_grow_ = sees_depth && stale_.views().empty() && !pieces_.misses_one();
        if (may_grow_)
            growth_.end_found_frame(pipeline_, template_, job.output);
        else
            growth_.end_lost_frame();  // it would join in the wrong place
    } else {
        job.state = DEFREC_LOST;
        pieces_.end_frame(DEFREC_LOST, pieces, uses_depth);
        growth_.end_lost_frame();
        last_rows_.clear();
        disparities_.skip_frame();
        std::copy(last_->motions.begin(), last_->motions.end(), job.output.motions.begin());
        std::copy(last_->samples.begin(), last_->samples.end(), job.output.samples.begin());
        if (job.input.samples != nullptr)
            pipeline_.leave_samples(job.output.samples, *job.input.samples);
        rigid_sums_.resize(vertex_runs(job.output.samples.size()));
        for (size_t run = 0; run < rigid_sums_.size(); ++run) measure_run(job, run);
        place_nodes(template_->data(), job.output.motions, job);
        ++age_;
    }
    is_tracking_ = is_found;
    job.epoch = epoch_;
    job.template_epoch = template_epoch_;
    job.age = age_;
    if (growth_.is_full()) job.reasons |= DEFREC_REASON_TEMPLATE_FULL;
    describe_surface(job, uses_depth);
    job.motions.assign(job.output.motions.begin(), job.output.motions.end());
    if (is_found) place_outside(job);
    shows_cuts_ = is_found && sees_depth && stale_.views().empty();
}

// Tissue out of the image changes in the results alone: the next frame starts from what lm gave.
void SurfaceFollower::place_outside(TrackerJob& job) {
    const bool any_outside = job.evidence.vertices_inside < job.output.samples.size();
    if (!outside_.add_frame(*template_, job.output.samples, any_outside, job.pieces,
                            {job.motions, job.vertices, job.normals, job.confidence}))
        return;
    place_nodes(template_->data(), job.motions, job);
    placed_.assign(job.output.samples.begin(), job.output.samples.end());
    for (size_t i = 0; i < placed_.size(); ++i) {
        std::copy_n(&job.vertices[3 * i], 3, placed_[i].position);
        std::copy_n(&job.normals[3 * i], 3, placed_[i].normal);
    }
    if (job.input.samples != nullptr) pipeline_.leave_samples(placed_, *job.input.samples);
    for (size_t run = 0; run < rigid_sums_.size(); ++run)
        rigid_sums_[run] = sum_for_rigid_motion(
            last_->model, vertex_run(SurfaceSamples(placed_), run), run * kVertexRun);
    fit_rigid_motion(last_->model, rigid_sums_, job.rigid_motion);
}

// The next frame starts from where they seem to be, and judges.
void SurfaceFollower::search_lost_pieces(const TrackerJob& job) {
    for (size_t piece = 0; piece < pieces_.pieces().size(); ++piece)
        if (pieces_.pieces()[piece].state == DEFREC_LOST)
            search_piece(template_->data(), piece, job.output.matches, last_->motions);
}

void SurfaceFollower::describe_surface(TrackerJob& job, bool uses_depth) {
    const std::shared_ptr<const Services> services = job.services();
    const Services* helpers = services->own_threads();
    const auto fit_motion = [&] { fit_rigid_motion(last_->model, rigid_sums_, job.rigid_motion); };
    if (job.state == DEFREC_LOST) {
        forget_confidence(job.age, job.confidence, job.output.samples.size());
        fit_motion();
        job.known = {job.input.held_motion, std::nullopt};
    } else {
        estimate_confidence(
            last_->model,
            {job.output, job.lateral, static_cast<float>(job.evidence.mean_residual_mm), rig_left_,
             job.state == DEFREC_RELOCALISED ? SurfaceSamples() : SurfaceSamples(last_->samples),
             uses_depth, job.is_interlaced(), disparities_.slip_px(), stale_.views()},
            helpers, fit_motion, job.confidence);
        forget_lost_pieces(pieces_.pieces(), template_->vertex_pieces(), job.confidence);
        job.known = {job.input.held_motion,
                     camera_.add_frame(job.input.camera_pose, job.rigid_motion)};
    }
    job.pieces.assign(pieces_.pieces().begin(), pieces_.pieces().end());
    const uint32_t observed =
        share_observed(template_->vertex_pieces(), job.confidence, job.pieces);
    job.observed_share = static_cast<float>(observed) /
                         static_cast<float>(std::max(1u, job.evidence.vertices_inside));
}

}  // namespace defrec
