// What becomes of a frame in class SurfaceRegistration: its state, its results, and what the next
// frames start from. How it is registered: surface_registration.cpp.
#include <algorithm>
#include <new>
#include <utility>

#include "sdk/base/os/helped_loop.hpp"
#include "sdk/base/os/services.hpp"
#include "sdk/tracking/surface_registration.hpp"

namespace defrec {
namespace {

// Nothing was searched in a frame of no use: a place in the queue must not show what an earlier
// frame had.
void clear_observations(FrameOutput& output) {
    defrec_match none{};
    none.feature = -1;
    none.distance = none.second = 256;
    std::fill(output.matches.begin(), output.matches.end(), none);
    for (const std::span<defrec_patch_observation> observations :
         {output.observations, output.checks, output.right_observations})
        std::fill(observations.begin(), observations.end(), defrec_patch_observation{});
    for (const std::span<defrec_patch_prediction> predictions :
         {output.predictions, output.check_predictions})
        std::fill(predictions.begin(), predictions.end(), defrec_patch_prediction{});
    output.summary->ransac = {};
}

}  // namespace

// A frame whose images are of no use.
void SurfaceRegistration::conclude_unusable(Frame& frame) {
    take_back(frame);
    pipeline_.forget(std::move(*frame.images));
    if (!surface_.has_template()) return conclude_without_template(frame);
    frame.job.make_room(surface_.data());
    clear_observations(frame.job.memory.output);
    FrameAttempt& attempt = attempts_[0];
    attempt.begin(surface_, {}, {});
    attempt.result.evidence = {};
    conclude(frame, attempt);
}

void SurfaceRegistration::conclude_without_template(Frame& frame) {
    FrameResult& result = frame.job.result;
    result.surface = nullptr;
    result.state = DEFREC_INITIALISING;
    result.epoch = result.template_epoch = result.age = 0;
    result.rig_estimate = frame.rig_estimate;
    result.reasons = frame.reasons;
    result.faulty_views = frame.faulty_views;
}

void SurfaceRegistration::conclude(Frame& frame, FrameAttempt& attempt) {
    const bool uses_depth = attempt.plan().uses_depth;
    const PieceEvidences pieces =
        attempt.quality.found
            ? weigh_pieces(surface_.data(), surface_.surface()->vertex_pieces(),
                           frame.job.memory.output, attempt.result.evidence, attempt.patch_px2())
            : PieceEvidences{};
    const bool is_found = attempt.quality.found && surface_.pieces().shows_any(pieces, uses_depth);
    if (is_found)
        conclude_found(frame, attempt, pieces);
    else
        conclude_lost(frame, attempt, pieces);
    FrameResult& result = attempt.result;
    result.epoch = surface_.epoch();
    result.template_epoch = surface_.template_epoch();
    result.age = surface_.age();
    if (growth_.is_full()) frame.reasons |= DEFREC_REASON_TEMPLATE_FULL;
    result.reasons = frame.reasons;
    result.faulty_views = frame.faulty_views;
    result.rig_estimate = frame.rig_estimate;
    // Tissue that is not seen takes longer than to wake up; where the frame before had none, this
    // one hardly has any.
    if (!is_found || !placed_.has_unseen) frame.job.announce_end();
    describe_surface(frame.job, attempt);
    const std::span<const defrec_motion> motions = frame.job.memory.output.motions;
    result.motions.assign(motions.begin(), motions.end());
    if (is_found) place_unseen(frame.job, attempt);
    // A frame that is relocalised has moved from a place of another time.
    if (is_found && uses_depth && result.state != DEFREC_RELOCALISED)
        add_unseen_lag(surface_.data().camera, rig_monitor_.state().left.unseen_lag_frames,
                       surface_.samples(), frame.job.memory.output.samples, result.confidence);
    if (is_found && uses_depth) rig_monitor_.end_depth();
    // A frame that is relocalised may still be on its way to where the surface is.
    if (frame.shows_cuts && result.state != DEFREC_RELOCALISED)
        surface_.add_depth(frame.job.memory.output.samples, attempt.photometric().is_confirmed,
                           result.confidence.status);
    frame.committed = &attempt;
    std::swap(frame.job.result, attempt.result);
    // Working memory stays where it has grown.
    std::swap(frame.job.result.confidence.spreading, attempt.result.confidence.spreading);
}

void SurfaceRegistration::conclude_found(Frame& frame, FrameAttempt& attempt,
                                         const PieceEvidences& pieces) {
    const FrameOutput& output = frame.job.memory.output;
    const bool uses_depth = attempt.plan().uses_depth,
               is_interlaced = (frame.reasons & DEFREC_REASON_INTERLACED) != 0,
               sees_depth = uses_depth && !is_interlaced && frame.last_attempt != nullptr &&
                            frame.last_attempt->plan().quality_level == QualityLevel::kFull;
    if (surface_.is_tracking() && attempt.is_fast(output.samples.size()))
        frame.reasons |= DEFREC_REASON_FAST_MOTION;
    attempt.result.state =
        surface_.found(output.motions, attempt.quality.degraded, pieces, uses_depth);
    const bool misses_piece = surface_.pieces().misses_one();
    if (misses_piece) {
        frame.reasons |= DEFREC_REASON_PIECE_LOST;
        surface_.search_lost_pieces(output.matches);
    }
    frame.shows_cuts = sees_depth && stale_.views().empty();
    frame.may_grow = frame.shows_cuts && !misses_piece;
    if (frame.may_grow)
        growth_.end_found_frame(pipeline_, surface_.surface(), output);
    else
        growth_.end_lost_frame();  // it would join in the wrong place
}

void SurfaceRegistration::conclude_lost(Frame& frame, FrameAttempt& attempt,
                                        const PieceEvidences& pieces) {
    FrameOutput& output = frame.job.memory.output;
    surface_.lost(pieces, attempt.plan().uses_depth);
    attempt.result.state = DEFREC_LOST;
    growth_.end_lost_frame();
    rig_monitor_.skip_frame();
    changes_.skip_frame();
    if (placed_.motions.empty()) place_changed();
    const SurfaceSamples samples = surface_.samples();
    std::copy(samples.begin(), samples.end(), output.samples.begin());
    if (placed_.has_unseen) move_to_placed(output.samples);
    std::copy(placed_.motions.begin(), placed_.motions.end(), output.motions.begin());
    if (frame.job.input.samples != nullptr)
        pipeline_.leave_samples(output.samples, *frame.job.input.samples);
    attempt.measure_surface(surface_, output);
}

// A template that was not found since it became what it is.
void SurfaceRegistration::place_changed() {
    surface_.move_samples();
    const std::span<const defrec_motion> motions = surface_.motions();
    placed_.motions.assign(motions.begin(), motions.end());
    placed_.has_unseen = false;
}

// Tissue that is not seen changes in the results alone: the next frame starts from what lm gave.
void SurfaceRegistration::place_unseen(TrackerJob& job, FrameAttempt& attempt) {
    FrameResult& result = attempt.result;
    const SurfaceSamples samples = job.memory.output.samples;
    const Services* helpers = job.services()->own_threads();
    placed_.has_unseen =
        surface_.place_unseen(samples, result.pieces,
                              {result.motions, result.vertices, result.normals, result.confidence,
                               [&] { job.announce_end(); },
                               [&](size_t run) { attempt.measure_again(surface_.model(), run); }},
                              helpers);
    placed_.motions.assign(result.motions.begin(), result.motions.end());
    if (!placed_.has_unseen) return;
    place_nodes(surface_.data(), result.motions, result.node_positions);
    attempt.fit_rigid_motion(surface_.model());
    placed_.vertices.resize(result.vertices.size());
    placed_.normals.resize(result.normals.size());
    if (job.input.samples == nullptr) return;
    keep_placed(result);
    std::vector<defrec_surface_sample> placed(samples.begin(), samples.end());
    move_to_placed(placed);
    pipeline_.leave_samples(placed, *job.input.samples);
}

void SurfaceRegistration::keep_placed(const FrameResult& result) {
    if (!placed_.has_unseen) return;
    std::copy(result.vertices.begin(), result.vertices.end(), placed_.vertices.begin());
    std::copy(result.normals.begin(), result.normals.end(), placed_.normals.begin());
}

void SurfaceRegistration::move_to_placed(std::span<defrec_surface_sample> samples) const {
    for (size_t i = 0; i < samples.size(); ++i) {
        std::copy_n(&placed_.vertices[3 * i], 3, samples[i].position);
        std::copy_n(&placed_.normals[3 * i], 3, samples[i].normal);
    }
}

void SurfaceRegistration::describe_surface(TrackerJob& job, FrameAttempt& attempt) {
    FrameResult& result = attempt.result;
    const Template& surface = *surface_.surface();
    if (result.state == DEFREC_LOST) {
        forget_confidence(result.age, result.confidence, job.memory.output.samples.size());
        attempt.fit_rigid_motion(surface_.model());
        result.known = {job.input.held_motion, std::nullopt};
    } else {
        colours_.take(job.colours);
        const SurfaceSamples before =
            result.state == DEFREC_RELOCALISED ? SurfaceSamples() : surface_.samples();
        estimate_confidence(
            surface_.model(),
            {job.memory.output, attempt.photometric(),
             static_cast<float>(result.evidence.mean_residual_mm), rig_monitor_.state().left,
             before, attempt.plan().uses_depth, result.is_interlaced(),
             rig_monitor_.state().disparities.baseline_drift_px(), stale_.views(),
             changes_.slip_doubts(), changes_.unconfirmed(), job.input.disparity,
             attempt.given_error_px, surface_.contradicted_depth().doubt_mm(),
             &surface_.depth_speed(), colours_.any() ? &colours_ : nullptr},
            job.services()->own_threads(), [&] { attempt.fit_rigid_motion(surface_.model()); },
            result.confidence);
        forget_lost_pieces(surface_.pieces().pieces(), surface.vertex_pieces(), result.confidence);
        forget_departed(job.memory.output.samples, attempt.photometric(), result.confidence);
        result.known = {
            job.input.held_motion,
            surface_.camera.add_frame(job.input.camera_pose, result.rigid_motion.data())};
    }
    result.pieces.assign(surface_.pieces().pieces().begin(), surface_.pieces().pieces().end());
    const uint32_t observed =
        share_observed(surface.vertex_pieces(), result.confidence, result.pieces);
    result.observed_share = static_cast<float>(observed) /
                            static_cast<float>(std::max(1u, result.evidence.vertices_inside));
}

void SurfaceRegistration::forget_departed(SurfaceSamples samples,
                                          const PhotometricEvidence& photometric,
                                          VertexConfidence& confidence) const {
    const DepartedTissue& departed = changes_.departed();
    const LiftedTissue& lifted = changes_.lifted();
    if (!departed.any() && !lifted.any()) return;
    const TemplateData& data = surface_.data();
    const bool sees_lifted =
        !lifted.any() || lifted.is_seen(data, samples, photometric.is_confirmed);
    for (size_t i = 0; i < data.vertices.size(); ++i)
        if (const uint32_t age = departed.age_of(data.vertices[i]); age > 0)
            forget_vertex(age, i, confidence);
        else if (!sees_lifted && photometric.is_confirmed[i] == 0 && lifted.moves(data.vertices[i]))
            forget_vertex(1, i, confidence);
}

// Ends the job, and then does what nobody waits for. The arrays stay as they are until this thread
// computes another frame.
void SurfaceRegistration::end(Frame& frame) {
    TrackerJob& job = frame.job;
    const FrameInput::Clock::time_point now = FrameInput::Clock::now();
    if (const FrameAttempt* last = frame.last_attempt)
        level_times_.add(last->plan().quality_level, now - last->time());
    if (now > job.input.deadline) job.result.reasons |= DEFREC_REASON_OVERDUE;
    job.finish(DEFREC_OK, "");
    if (surface_.is_tracking()) {
        keep_placed(job.result);
        ended_ =
            Ended{job.memory.output, frame.shows_cuts ? &frame.committed->photometric() : nullptr,
                  job.services()->own_threads(), changes_.want_next_frame()};
    }
    // Beside the next frame, which a device that works by itself computes, unless that starts from
    // where lifted tissue goes.
    if (pipeline_.can_follow_speculatively()) {
        const bool starts_elsewhere = changes_.lifted().any();
        if (ended_ && !starts_elsewhere) {
            ended_->looking_has_it = true;
            looking_.begin();
        }
        surface_.begin_to_learn_unseen();
        if (starts_elsewhere) look_at_ended();
    } else {
        learn_from_ended(job.services()->own_threads());
    }
    if (frame.may_grow) plan_growth(job);
}

// Neither part needs the other.
void SurfaceRegistration::learn_from_ended(const Services* helpers) {
    helped_loop(helpers, 2, [&](size_t part) {
        if (part == 0)
            surface_.learn_unseen();
        else
            look_at_ended();
    });
}

// What later frames read of it.
void SurfaceRegistration::keep_ended() {
    if (!ended_ || std::exchange(ended_->is_kept, true)) return;
    surface_.keep_samples(ended_->output.samples);
    if (ended_->photometric == nullptr) return;
    try {
        colours_.learn(ended_->output.samples, ended_->photometric->is_confirmed);
    } catch (const std::bad_alloc&) {
        // The job has ended, and later frames show the same colours.
    }
}

void SurfaceRegistration::look_for_changes() noexcept {
    if (ended_->photometric == nullptr) return changes_.skip_frame();
    changes_.add_frame(surface_.data(), ended_->output, ended_->photometric->is_located,
                       ended_->helpers);
}

void SurfaceRegistration::look_at_ended() {
    if (!ended_) return;
    keep_ended();
    if (ended_->looking_has_it)
        looking_.wait();
    else
        look_for_changes();
    if (ended_->photometric != nullptr)
        surface_.start_from(
            [&](std::span<defrec_motion> motions) { changes_.lifted().place(motions); });
    ended_.reset();
}

// After the job has ended, which must hear of no failure any more.
void SurfaceRegistration::plan_growth(const TrackerJob& job) noexcept {
    try {
        growth_.plan(surface_.data(), job.memory.output);
    } catch (const std::exception&) {
        growth_.end_lost_frame();  // later frames show the same tissue
    }
}

}  // namespace defrec
