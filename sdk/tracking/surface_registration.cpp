// See surface_registration.hpp; what becomes of a frame: surface_registration_results.cpp.
#include "sdk/tracking/surface_registration.hpp"

#include <algorithm>
#include <cmath>
#include <new>

#include "sdk/base/os/services.hpp"
#include "sdk/template/cut.hpp"
#include "sdk/tracking/decisions/disparity.hpp"
#include "sdk/tracking/decisions/images.hpp"
#include "sdk/tracking/decisions/template_changes.hpp"
#include "sdk/tracking/evidence/vertex_runs.hpp"
#include "sdk/tracking/monitors/frame_state.hpp"

namespace defrec {
namespace {

bool is_in_memory(const TrackerJob& job, size_t view) {
    return job.input.views[view].memory != nullptr;
}

bool asks_for_template(const TrackerJob& job) {
    return (job.input.flags & DEFREC_FRAME_CAPTURE_TEMPLATE) != 0;
}

FrameTask task_of(TrackerJob& job) {
    return {job.input,
            {job.views[0].as<uint8_t>().data(), job.views[1].as<uint8_t>().data()},
            job.memory.output};
}

bool is_frozen(uint32_t reasons) { return (reasons & DEFREC_REASON_FROZEN) != 0; }

}  // namespace

SurfaceRegistration::SurfaceRegistration(const std::shared_ptr<const Rig>& rig,
                                         const std::shared_ptr<Device>& device,
                                         const TrackerSettings& settings, FrameQueue& frames)
    : rig_(rig),
      frames_(frames),
      max_features_(settings.max_features),
      growth_(settings),
      pipeline_(rig, device, settings),
      surface_(settings.body == DEFREC_BODY_ON),
      images_(rig),
      rig_monitor_(rig->width(), rig->height(), settings.self_calibration),
      colours_(rig),
      attempts_{FrameAttempt(settings, rig_monitor_.state()),
                FrameAttempt(settings, rig_monitor_.state())},
      second_memory_(device) {}

void SurfaceRegistration::compute(TrackerJob& job) noexcept {
    try {
        // Goes before the job ends where it fails: the device may still be at work on what is the
        // application's again from then on.
        Frame frame{job};
        process(frame);
        end(frame);
    } catch (const Error& error) {
        job.finish(error.status(), error.what());
    } catch (const std::bad_alloc&) {
        job.finish(DEFREC_ERROR_OUT_OF_MEMORY, "out of memory");
    } catch (const std::exception& error) {
        job.finish(DEFREC_ERROR_INTERNAL, error.what());
    }
}

void SurfaceRegistration::cancel(TrackerJob& job) noexcept {
    if (prefetched_ && prefetched_->job == &job) prefetched_.reset();
    job.finish(DEFREC_ERROR_STATE, "the tracker was destroyed before this frame was computed");
}

void SurfaceRegistration::process(Frame& frame) {
    stale_.clear();
    rig_monitor_.begin_frame();
    frame.rig_estimate = rig_monitor_.estimate();
    frame.rig_estimate.lag_frames = 0;  // unless the frame shows one
    // The device begins while the host looks; frames in which there is nothing to observe are few.
    begin_beside_ended(frame);
    const bool left_shows = look_at_images(frame);
    // By what its tissue did, the frame before decides in few frames how this one is registered.
    look_at_ended();
    if (!can_begin_speculatively(frame.job)) take_back(frame);
    if ((frame.reasons & DEFREC_REASON_GAP) != 0) changes_.skip_frame();
    if (!left_shows || (frame.spoils_rows && !surface_.is_tracking()))
        return conclude_unusable(frame);
    if (frame.captures) return capture_and_register(frame);
    if (release_cut()) frame.reasons |= DEFREC_REASON_CUT;
    if (grow()) frame.reasons |= DEFREC_REASON_TEMPLATE_GREW;
    FrameAttempt& attempt = register_surface(frame);
    correct_rig();
    conclude(frame, attempt);
    judge_template(frame);
}

// What is known to wait for the frame before is not begun beside it.
void SurfaceRegistration::begin_beside_ended(Frame& frame) {
    TrackerJob& job = frame.job;
    const bool changes_template = job.template_to_set != nullptr || to_adopt_ != nullptr;
    if (changes_template || !can_begin_speculatively(job)) look_at_ended();
    // In the same place of the queue the device writes where that frame's results are.
    if (ended_ && ended_->output.samples.data() == job.memory.output.samples.data())
        job.memory.exchange(second_memory_, surface_.data());
    begin(frame);
    keep_ended();
}

// The device observes the frame, and registers it unless the host has to see it first.
void SurfaceRegistration::begin(Frame& frame) {
    TrackerJob& job = frame.job;
    if (prefetched_ && prefetched_->job == &job) {
        auto result = std::move(prefetched_->result);
        prefetched_.reset();
        if (const auto* failure = std::get_if<std::exception_ptr>(&result))
            std::rethrow_exception(*failure);
        frame.images.emplace(std::get<ObservedFrame>(std::move(result)));
    } else {
        if (job.template_to_set != nullptr) to_adopt_ = std::exchange(job.template_to_set, nullptr);
        if (to_adopt_ != nullptr) adopt_set_template(job);
    }
    if (can_begin_speculatively(job))
        begin_speculatively(frame);
    else if (!frame.images)
        frame.images.emplace(pipeline_.observe(task_of(job)));
}

// Where that fails, this frame does, and those after it: never is another template tracked in its
// place. But a frame that is captured, if it can be, is a template of its own.
void SurfaceRegistration::adopt_set_template(const TrackerJob& job) {
    try {
        adopt(to_adopt_, TrackedSurface::Source::kGiven);
    } catch (const std::exception&) {
        if (!asks_for_template(job)) throw;
        return;
    }
    frames_.end_template(*std::exchange(to_adopt_, nullptr));
}

// Queues the images of the next frame, if it was submitted, behind the work on this one, so that
// the device has something to do while the host concludes this one. A device that computes in this
// thread is done by now, and its results are not kept waiting. false: such a frame may still come.
bool SurfaceRegistration::prefetch(const RegisteredFrame& registered) {
    if (prefetched_ || !pipeline_.can_observe() || pipeline_.done(registered, 0)) return true;
    const FrameQueue::Next next = frames_.next();
    if (next.job == nullptr) return !next.may_come;
    // May change what stereo searches, and is to be adopted first.
    if (next.job->template_to_set != nullptr || to_adopt_ != nullptr) return true;
    try {
        prefetched_.emplace(Prefetched{next.job, pipeline_.observe(task_of(*next.job))});
    } catch (const std::exception&) {
        prefetched_.emplace(Prefetched{next.job, std::current_exception()});
    }
    return true;
}

// Most frames are as expected: a device that works by itself goes on with theirs while the host
// still looks at the images. Not where more than the images decides how they are registered.
bool SurfaceRegistration::can_begin_speculatively(const TrackerJob& job) const {
    const bool are_awaited = ended_ ? ended_->changes_wanted : changes_.want_next_frame();
    return surface_.is_tracking() && !asks_for_template(job) && !are_awaited && growth_.rests() &&
           pipeline_.can_follow_speculatively();
}

// Where it fails the frame is observed after all: its images decide whether the failure matters.
void SurfaceRegistration::begin_speculatively(Frame& frame) {
    TrackerJob& job = frame.job;
    FrameAttempt& attempt =
        begin_attempt(frame, attempts_[0], {.uses_depth = !is_depth_spoilt_, .whole_map = false});
    try {
        job.make_room(surface_.data());
        const std::span<const defrec_motion> start = surface_.motions();
        frame.begun.emplace(
            frame.images ? pipeline_.follow(std::move(*frame.images), start, attempt.plan())
                         : pipeline_.observe_and_follow(task_of(job), start, attempt.plan()));
    } catch (const std::exception&) {
        frame.begun.emplace(std::current_exception());
        if (!frame.images) frame.images.emplace(pipeline_.observe(task_of(job)));
    }
}

// The frame is as if no attempt had begun.
void SurfaceRegistration::take_back(Frame& frame) {
    if (!frame.begun) return;
    if (auto* registered = std::get_if<RegisteredFrame>(&*frame.begun))
        frame.images.emplace(pipeline_.take_back(std::move(*registered)));
    frame.begun.reset();
    frame.last_attempt = nullptr;
}

// false: the left view shows nothing.
bool SurfaceRegistration::look_at_images(Frame& frame) {
    TrackerJob& job = frame.job;
    if (const auto* registered =
            frame.begun ? std::get_if<RegisteredFrame>(&*frame.begun) : nullptr)
        pipeline_.await_gray(*registered);
    else
        pipeline_.await_gray(*frame.images);
    const auto view = [&](size_t i) -> ImageCheck::View {
        return {job.views[i].as<uint8_t>().data(), is_in_memory(job, i)};
    };
    const StreamCheck::Finding finding =
        images_.look_at({job.input.timestamp_ns, job.input.field, {view(0), view(1)}},
                        job.services()->own_threads());
    frame.reasons = finding.reasons;
    frame.faulty_views = finding.faulty_views;
    if ((frame.reasons & DEFREC_REASON_GAP) != 0) rig_monitor_.begin_anew();
    frame.left_is_frozen = finding.left.is_frozen_alone;
    frame.has_one_view =
        !finding.right.shows || frame.left_is_frozen || finding.right.is_frozen_alone;
    // What an interlaced frame shows is of two times as well, but its depth is better than none.
    frame.spoils_rows = frame.has_one_view || (frame.reasons & DEFREC_REASON_INTERLACED) != 0;
    frame.is_first = !surface_.has_template();
    frame.captures = !frame.spoils_rows && (frame.is_first || asks_for_template(job));
    return finding.left.shows;
}

// A template keeps the depth that it was captured with: where its own frame shows that the rig
// wants correction, it is captured again. One that its own frame does not show is none.
void SurfaceRegistration::capture_and_register(Frame& frame) {
    const uint32_t reasons = frame.reasons, faulty_views = frame.faulty_views;
    auto source = TrackedSurface::Source::kCaptured;
    for (int corrections = 0;; ++corrections) {
        const bool is_captured = capture(frame, source);
        if (!surface_.has_template()) return conclude_without_template(frame);
        FrameAttempt& attempt = register_surface(frame);
        const bool is_wrong = is_captured && (frame.reasons & DEFREC_REASON_DISPARITY) != 0;
        if (is_wrong || (frame.is_first && !attempt.quality.found)) {
            if (!is_wrong) frame.reasons |= DEFREC_REASON_LOW_CONTRAST;
            surface_.withdraw();
            forget_template(frame);
            return refuse_hiding_mask(frame);
        }
        if (!correct_rig() || corrections == decisions::RigRows::kMostCorrections)
            return conclude(frame, attempt);
        frame.images.reset();
        frame.images.emplace(pipeline_.observe(task_of(frame.job)));
        frame.reasons = reasons;
        frame.faulty_views = faulty_views;
        if (is_captured) source = TrackedSurface::Source::kCapturedAgain;
    }
}

bool SurfaceRegistration::capture(Frame& frame, TrackedSurface::Source source) {
    std::optional<TemplateData> data =
        pipeline_.capture(*frame.images, source == TrackedSurface::Source::kCapturedAgain);
    if (!data) {
        refuse_hiding_mask(frame);
        frame.reasons |= DEFREC_REASON_NO_DEPTH;
        if (contradicts_given_disparity(frame)) frame.reasons |= DEFREC_REASON_DISPARITY;
        if (pipeline_.views_look_swapped(*frame.images))
            frame.reasons |= DEFREC_REASON_VIEWS_SWAPPED;
        return false;
    }
    adopt(std::make_shared<const Template>(std::move(*data), frame.job.services()), source);
    if (!asks_for_template(frame.job))
        trial_.begin(frame.job.memory.output.summary->features,
                     least_features(surface_.data(), max_features_));
    if (to_adopt_ != nullptr) frames_.end_template(*std::exchange(to_adopt_, nullptr));
    return true;
}

void SurfaceRegistration::adopt(std::shared_ptr<const Template> surface,
                                TrackedSurface::Source source) {
    TrackedSurface::Next next(std::move(surface));
    second_memory_.make_room(next.data());
    pipeline_.set_template(next.data());
    surface_.adopt(std::move(next), source);
    rig_monitor_.forget_template();
    forget_course();
}

// Growth, trial and cuts are begun with a template, and end with it.
void SurfaceRegistration::forget_course() {
    colours_.forget();
    growth_.reset();
    trial_.end();
    changes_.reset();
    placed_.motions.clear();
}

// A frame that gives no template only because its mask hides the tissue is the caller's mistake.
void SurfaceRegistration::refuse_hiding_mask(Frame& frame) {
    using decisions::IgnoreMask;
    if (!frame.job.input.ignore.given()) return;
    const Pipeline::IgnoredDepth depth = pipeline_.look_behind_mask(*frame.images);
    if (depth.depth_share < decisions::TemplateSurface::kMinCoverage ||
        depth.ignored_share < IgnoreMask::kMinHidden)
        return;
    fail(DEFREC_ERROR_ARGUMENT, "ignore hides the tissue: it marks ",
         std::lround(100 * depth.ignored_share),
         " % of the pixels of the left image that have depth, and the others give no template; "
         "nonzero pixels are those that are not used, so if the mask is inverted, exchange zero "
         "and nonzero");
}

// Whether enough of the template is seen again in its own frame.
bool SurfaceRegistration::shows_template(const Frame& frame, const FrameAttempt& attempt) const {
    using decisions::TemplateTrial;
    const SurfaceSamples samples = frame.job.memory.output.samples;
    size_t shown = 0;
    for (size_t i = 0; i < samples.size(); ++i)
        shown +=
            samples[i].observation == DEFREC_OBSERVED && attempt.photometric().is_confirmed[i] != 0;
    const auto vertices = static_cast<double>(samples.size());
    if (static_cast<double>(shown) >= TemplateTrial::kMinShown * vertices) return true;
    const Evidence& evidence = attempt.result.evidence;
    return evidence.patches_confirmed >= TemplateTrial::kMinPatches * vertices &&
           evidence.patch_rms_px <= TemplateTrial::kMaxPatchRms;
}

// After a frame with a template that it did not give.
void SurfaceRegistration::judge_template(Frame& frame) {
    if (frame.spoils_rows) return;
    const bool is_found = frame.job.result.state != DEFREC_LOST;
    if (trial_.add_frame(is_found, frame.job.result.evidence.features)) give_up_template(frame);
}

// The application hears of it by a frame without a template; the next one gives another.
void SurfaceRegistration::give_up_template(Frame& frame) {
    surface_.give_up();
    forget_template(frame);
}

// Drops all that was made for it.
void SurfaceRegistration::forget_template(Frame& frame) {
    frame.shows_cuts = frame.may_grow = false;
    prefetched_.reset();  // it was observed in the template's range of depths
    pipeline_.forget_template();
    forget_course();
    conclude_without_template(frame);
}

void SurfaceRegistration::change_template(TemplateData changed,
                                          std::vector<defrec_motion> motions) {
    TrackedSurface::Next next(std::move(changed), std::move(motions), surface_);
    second_memory_.make_room(next.data());
    pipeline_.set_template(next.data());
    surface_.change(std::move(next));
    placed_.motions.clear();
    rig_monitor_.forget_vertices();
}

// Releases what connects the sides of a cut, or of a line that they slide along, that the frames
// before showed; false where there is none. Tissue that was about to join is fitted anew.
bool SurfaceRegistration::release_cut() {
    if (!changes_.found_line()) return false;
    const Tear tear = changes_.found_lines();
    std::vector<defrec_motion> motions(surface_.motions().begin(), surface_.motions().end());
    for (const auto& [node, motion] : tear.motions) motions[node] = motion;
    TemplateData data = surface_.data();
    for (const CutLine& line : tear.lines) data = release_across(std::move(data), line);
    change_template(std::move(data), std::move(motions));
    changes_.end_release();
    growth_.begin_anew();
    return true;
}

// Takes in the tissue that is to join with this frame; false where there is none.
bool SurfaceRegistration::grow() {
    std::optional<Growth> growth = growth_.begin_frame();
    if (!growth) return false;
    std::vector<defrec_motion> motions(surface_.motions().begin(), surface_.motions().end());
    extend_motions(growth->data.nodes, growth->anchors, motions);
    change_template(std::move(growth->data), std::move(motions));
    growth_.joined(surface_.data(), growth->anchors);
    return true;
}

FrameAttempt& SurfaceRegistration::register_surface(Frame& frame) {
    frame.job.make_room(surface_.data());
    FrameAttempt* attempt = &attempt_first(frame);
    if (frame.captures && frame.is_first && !shows_template(frame, *attempt))
        attempt->quality.found = false;
    // The frame jumped to another part of the map than it was expected in.
    if (pipeline_.solved_part() &&
        (!attempt->quality.found || !pipeline_.solved_all_seen(frame.job.memory.output.motions)))
        attempt = &attempt_whole_map(frame, attempt->plan());
    check_given_disparity(frame, *attempt);
    commit_rig(frame, *attempt);
    // Depth of a repeated frame is as spoilt as it was.
    is_depth_spoilt_ = !frame.spoils_rows && surface_.is_tracking() &&
                       (is_frozen(frame.reasons) ? is_depth_spoilt_ : lag_spoils_depth(frame.job));
    if (is_depth_spoilt_ && attempt->plan().uses_depth && !frame.captures)
        attempt = &attempt_without_depth(frame, *attempt);
    else if (!frame.captures && surface_.is_tracking() && attempt->result.evidence.confirms_few() &&
             wide_search_.is_due())
        attempt = &attempt_widely(frame, *attempt);
    if (attempt == &attempts_[1]) check_given_disparity(frame, *attempt);
    find_stale_parts(frame, *attempt);
    if (changes_.departed().share() > decisions::Departure::kMaxShare)
        attempt->quality.add(DEFREC_REASON_LARGE_RESIDUAL);
    const RegistrationPlan& plan = attempt->plan();
    if (!attempt->quality.found && plan.uses_depth &&
        plan.quality_level != QualityLevel::kUnchecked && contradicts_given_disparity(frame))
        attempt->quality.add(DEFREC_REASON_DISPARITY);
    if (frame.job.input.disparity.is_empty) attempt->quality.add(DEFREC_REASON_NO_DEPTH);
    frame.reasons |= attempt->quality.reasons;
    if (!attempt->quality.found && plan.uses_depth) look_for_swapped_views(frame);
    return *attempt;
}

// Its plan gets the quality level that the frame's time allows from here on.
FrameAttempt& SurfaceRegistration::begin_attempt(Frame& frame, FrameAttempt& attempt,
                                                 RegistrationPlan plan) {
    const FrameInput::Clock::time_point now = FrameInput::Clock::now();
    plan.quality_level = level_times_.choose(frame.job.input.deadline - now);
    // A wrong disparity would stay in the template.
    if (frame.captures && frame.job.input.disparity.given())
        plan.quality_level = std::min(plan.quality_level, QualityLevel::kCoarse);
    attempt.begin(surface_, plan, now);
    frame.last_attempt = &attempt;
    return attempt;
}

FrameAttempt& SurfaceRegistration::attempt_first(Frame& frame) {
    const bool uses_depth = !frame.has_one_view && !frame.job.input.disparity.is_empty &&
                            (frame.captures || !surface_.is_tracking() || !is_depth_spoilt_);
    FrameAttempt& attempt = attempts_[0];
    if (frame.begun && attempt.plan().uses_depth != uses_depth) take_back(frame);
    if (!frame.begun) {
        begin_attempt(frame, attempt,
                      {.uses_depth = uses_depth, .whole_map = !surface_.is_tracking()});
        return follow(frame, surface_.motions(), attempt);
    }
    if (const auto* failure = std::get_if<std::exception_ptr>(&*frame.begun))
        std::rethrow_exception(*failure);
    return finish(frame, std::get<RegisteredFrame>(std::move(*frame.begun)), attempt);
}

FrameAttempt& SurfaceRegistration::attempt_whole_map(Frame& frame, RegistrationPlan plan) {
    plan.whole_map = true;
    return follow(frame, surface_.motions(), begin_attempt(frame, attempts_[0], plan));
}

FrameAttempt& SurfaceRegistration::attempt_without_depth(Frame& frame, const FrameAttempt& before) {
    RegistrationPlan plan = before.plan();
    plan.uses_depth = false;
    const uint32_t of_rig =
        before.quality.reasons & (kReasonsOfRig | uint32_t{DEFREC_REASON_DISPARITY});
    FrameAttempt& attempt =
        follow(frame, surface_.motions(), begin_attempt(frame, attempts_[0], plan));
    attempt.quality.reasons |= of_rig;
    attempt.quality.degraded = true;
    return attempt;
}

// Tissue that is blurred or has moved far shows few of its patches near where they are expected;
// coarser images, searched farther round what was found so far, show more. Where an instrument
// hides them they show fewer, and what was found before is kept.
FrameAttempt& SurfaceRegistration::attempt_widely(Frame& frame, FrameAttempt& before) {
    TrackerJob& job = frame.job;
    const FrameAttempt* const last = frame.last_attempt;
    RegistrationPlan plan = before.plan();
    plan.searches_widely = true;
    FrameAttempt& wide = begin_attempt(frame, attempts_[1], plan);
    if (wide.plan().quality_level != QualityLevel::kFull) {
        frame.last_attempt = last;
        before.quality.reasons |= DEFREC_REASON_COARSE;
        return before;
    }
    const std::span<const defrec_motion> start =
        before.quality.found ? job.memory.output.motions : surface_.motions();
    job.memory.exchange(second_memory_, surface_.data());
    follow(frame, start, wide);
    const bool is_better = wide.quality.found && wide.result.evidence.confirmed_share() >
                                                     before.result.evidence.confirmed_share();
    wide_search_.end(is_better);
    if (is_better) {
        wide.quality.reasons |= before.quality.reasons & kReasonsOfRig;
        if (before.result.evidence.confirms_few() &&
            (wide.quality.reasons & DEFREC_REASON_OCCLUDED) == 0)
            wide.quality.reasons |= DEFREC_REASON_LOW_CONTRAST;
        wide.quality.degraded = true;
        return wide;
    }
    job.memory.exchange(second_memory_, surface_.data());
    if (job.input.samples != nullptr)
        pipeline_.leave_samples(job.memory.output.samples, *job.input.samples);
    return before;
}

FrameAttempt& SurfaceRegistration::follow(Frame& frame, std::span<const defrec_motion> start,
                                          FrameAttempt& attempt) {
    if (FrontImages* images = growth_.images()) pipeline_.read_front(*frame.images, *images);
    if (std::vector<uint8_t>* image = changes_.image()) pipeline_.read_gray(*frame.images, *image);
    return finish(frame, pipeline_.follow(std::move(*frame.images), start, attempt.plan()),
                  attempt);
}

FrameAttempt& SurfaceRegistration::finish(Frame& frame, RegisteredFrame registered,
                                          FrameAttempt& attempt) {
    TrackerJob& job = frame.job;
    const FrameOutput& output = job.memory.output;
    const Services* helpers = job.services()->own_threads();
    attempt.prepare_measuring(surface_, rig_monitor_);
    wait_.wait({[&](uint64_t timeout_ns) { return pipeline_.done(registered, timeout_ns); },
                [&] { return prefetch(registered); },
                [&] {
                    if (helpers != nullptr) helpers->rouse(kMaxVertexThreads - 1);
                }},
               pipeline_.deadline());
    frame.images.emplace(pipeline_.finish(std::move(registered)));
    wait_.end();
    attempt.measure(surface_, rig_monitor_, pipeline_, output, helpers);
    if (const FrontImages* images = growth_.images()) pipeline_.check(*images);
    return attempt;
}

void SurfaceRegistration::commit_rig(Frame& frame, FrameAttempt& attempt) {
    FrameQuality& quality = attempt.quality;
    // A surface that was led to a wrong depth looks like a rig that is wrong.
    if (frame.spoils_rows || (quality.reasons & DEFREC_REASON_DISPARITY) != 0) {
        rig_monitor_.skip_frame();
        quality.degraded = true;
        return;
    }
    if (!quality.found || !rig_monitor_.is_on()) return;
    // Nothing moves in the picture of the frame before, and it has been measured.
    if (!is_frozen(frame.reasons)) {
        // Disparities of the application tell of no rig: check_given_disparity looks at them.
        const bool shows_disparities = surface_.is_tracking() && attempt.plan().uses_depth &&
                                       !frame.job.input.disparity.given() &&
                                       attempt.plan().quality_level == QualityLevel::kFull;
        rig_monitor_.commit(attempt.rig(), shows_disparities
                                               ? RigMonitor::Disparities::kCount
                                               : RigMonitor::Disparities::kSayNothing);
    }
    frame.rig_estimate = rig_monitor_.estimate();
    quality.add(rig_monitor_.reasons());
}

void SurfaceRegistration::check_given_disparity(Frame& frame, FrameAttempt& attempt) {
    const KeptDisparity& given = frame.job.input.disparity;
    const RegistrationPlan& plan = attempt.plan();
    if (!given.given() || !attempt.quality.found || !rig_monitor_.is_on() || frame.spoils_rows ||
        !plan.uses_depth || plan.quality_level == QualityLevel::kUnchecked)
        return;
    const DisparityCheck check = check_disparity(surface_.data(), frame.job.memory.output, given);
    if (check.is_by_unfound && !contradicts_given_disparity(frame)) return;
    attempt.given_error_px = check.error_px;
    if (check.disagrees) attempt.quality.add(DEFREC_REASON_DISPARITY);
}

// Where the patches of a surface cannot tell, stage stereo measures for itself.
bool SurfaceRegistration::contradicts_given_disparity(Frame& frame) {
    const KeptDisparity& given = frame.job.input.disparity;
    if (!given.given() || !rig_monitor_.is_on() || frame.spoils_rows) return false;
    const std::optional<double> difference = pipeline_.compare_given_disparity(*frame.images);
    return difference && is_off(given, *difference);
}

// Whether depth errs more by what moved between the views' times than it does when the left image
// alone tells where the surface is.
bool SurfaceRegistration::lag_spoils_depth(const TrackerJob& job) const {
    constexpr double kError = decisions::ViewLag::kOneViewError;
    if (!rig_monitor_.state().monitor.is_late()) return false;
    const defrec_camera& camera = surface_.data().camera;
    const double lag = rig_monitor_.state().left.lag_frames;
    const SurfaceSamples before = surface_.samples(), after = job.memory.output.samples;
    double squares = 0;
    size_t count = 0;
    for (size_t i = 0; i < after.size(); ++i) {
        if (after[i].observation == DEFREC_OUTSIDE) continue;
        const double depth = lag * depth_per_px(camera, after[i].position[2]);
        squares += depth * depth * squared_step(camera, before[i], after[i]);
        ++count;
    }
    return squares > kError * kError * static_cast<double>(count);
}

// A part of a picture that stands still while the rest moves on says nothing.
void SurfaceRegistration::find_stale_parts(Frame& frame, FrameAttempt& attempt) {
    using decisions::FrozenImages;
    const SurfaceSamples samples = frame.job.memory.output.samples;
    const bool repeats =
        stale_.count_frozen(is_frozen(frame.reasons)) > FrozenImages::kMostRepeated;
    if (repeats || frame.left_is_frozen) {
        stale_.set_all(samples.size());
        attempt.quality.degraded = true;
        return;
    }
    if (!attempt.quality.found || !surface_.is_tracking() || is_frozen(frame.reasons)) return;
    std::span<const uint8_t> seen_left;
    if (!attempt.plan().uses_depth) seen_left = attempt.photometric().is_confirmed;
    stale_.find(*rig_, images_.blocks(), {is_in_memory(frame.job, 0), is_in_memory(frame.job, 1)},
                surface_.samples(), samples, seen_left);
    if (stale_.share() < FrozenImages::kMinStaleShare) return;
    attempt.quality.reasons |= DEFREC_REASON_FROZEN;
    attempt.quality.degraded = true;
    if ((frame.reasons & DEFREC_REASON_ONE_VIEW) == 0) frame.faulty_views |= stale_.of_views();
}

// A frame that is lost, without depth, although the exchanged views would have some.
void SurfaceRegistration::look_for_swapped_views(Frame& frame) {
    if ((frame.reasons & DEFREC_REASON_NO_DEPTH) == 0 || !swapped_search_.is_due()) return;
    const bool look_swapped = pipeline_.views_look_swapped(*frame.images);
    swapped_search_.end(look_swapped);
    if (look_swapped) frame.reasons |= DEFREC_REASON_VIEWS_SWAPPED;
}

// Takes what the monitor has found into the right view's map; false where that is too little.
bool SurfaceRegistration::correct_rig() {
    const std::optional<Rig::ViewShift> shift = rig_monitor_.due_correction();
    if (!shift) return false;
    prefetched_.reset();  // it was observed without
    pipeline_.shift_right_view(*shift);
    rig_monitor_.correct(*shift);
    return true;
}

}  // namespace defrec
