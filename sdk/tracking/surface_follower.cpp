// See surface_follower.hpp; results: surface_follower_results.cpp.
#include "sdk/tracking/surface_follower.hpp"

#include <algorithm>
#include <chrono>
#include <new>
#include <numbers>
#include <optional>
#include <thread>

#include "backends/shared/motion.hpp"
#include "sdk/base/os/platform.hpp"
#include "sdk/template/cut.hpp"
#include "sdk/tracking/evidence/vertex_runs.hpp"

namespace defrec {
namespace {

defrec_surface_sample at_rest(const defrec_surface_point& point) {
    defrec_surface_sample sample{};
    std::copy(std::begin(point.position), std::end(point.position), sample.position);
    std::copy(std::begin(point.normal), std::end(point.normal), sample.normal);
    sample.observation = DEFREC_NO_DEPTH;
    return sample;
}

defrec_surface_sample moved(const defrec_surface_point& point,
                            std::span<const defrec_motion> motions) {
    defrec_surface_sample sample = at_rest(point);
    const auto motion = blend<double>(motions.data(), point.node, point.weight);
    store3(apply(motion, load3<double>(point.position)), sample.position);
    store3(rotate(motion, load3<double>(point.normal)), sample.normal);
    return sample;
}

bool is_frozen(const TrackerJob& job) { return (job.reasons & DEFREC_REASON_FROZEN) != 0; }

bool is_in_memory(const TrackerJob& job, int view) {
    return job.input.views[static_cast<size_t>(view)].memory != nullptr;
}

constexpr uint32_t kReasonsOfRig = DEFREC_REASON_VIEW_LATE | DEFREC_REASON_CALIBRATION;

FrameTask task_of(TrackerJob& job) {
    return {job.input,
            {job.views[0].as<uint8_t>().data(), job.views[1].as<uint8_t>().data()},
            job.output};
}

void expect_room_for_samples(const TrackerJob& job) {
    const uint64_t needed = job.output.samples.size() * sizeof(defrec_surface_sample);
    if (job.input.samples != nullptr && job.input.samples->size() < needed)
        fail(DEFREC_ERROR_ARGUMENT, "samples: the memory has ", job.input.samples->size(),
             " bytes, ", needed, " are needed for ", job.output.samples.size(), " vertices");
}

// Nothing was searched in a frame of no use: a place in the queue must not show what an earlier
// frame had.
void forget_evidence(TrackerJob& job) {
    job.evidence = {};
    defrec_match none{};
    none.feature = -1;
    none.distance = none.second = 256;
    std::fill(job.output.matches.begin(), job.output.matches.end(), none);
    for (const std::span<defrec_patch_observation> observations :
         {job.output.observations, job.output.checks, job.output.right_observations})
        std::fill(observations.begin(), observations.end(), defrec_patch_observation{});
    for (const std::span<defrec_patch_prediction> predictions :
         {job.output.predictions, job.output.check_predictions})
        std::fill(predictions.begin(), predictions.end(), defrec_patch_prediction{});
    job.output.summary->ransac = {};
}

double radians(float degrees) { return degrees * std::numbers::pi / 180; }

// What is left of the rig's error, and what is corrected of it.
RigEstimate in_all(RigEstimate left, const Rig::ViewShift& corrected) {
    left.vertical_offset_px += static_cast<float>(corrected.offset_px);
    left.roll_deg += static_cast<float>(corrected.roll * 180 / std::numbers::pi);
    left.focal_ratio += static_cast<float>(corrected.ratio);
    return left;
}

}  // namespace

SurfaceFollower::SurfaceFollower(std::shared_ptr<const Rig> rig,
                                 const std::shared_ptr<Device>& device,
                                 const TrackerSettings& settings, FrameQueue& frames)
    : rig_(std::move(rig)),
      frames_(frames),
      growth_(settings),
      pipeline_(rig_, device, settings),
      blocks_{StandingBlocks(rig_->width(), rig_->height()),
              StandingBlocks(rig_->width(), rig_->height())},
      rig_monitor_(rig_->width(), rig_->height()),
      rig_after_(rig_monitor_),
      has_body_(settings.body == DEFREC_BODY_ON),
      watches_rig_(settings.self_calibration != DEFREC_SELF_CALIBRATION_OFF),
      corrects_rig_(settings.self_calibration == DEFREC_SELF_CALIBRATION_CORRECT) {}

std::shared_ptr<const Template> SurfaceFollower::current_template() const {
    const std::lock_guard lock(template_mutex_);
    return template_;
}

void SurfaceFollower::compute(TrackerJob& job) noexcept {
    try {
        chosen_.reset();
        shows_cuts_ = may_grow_ = false;
        process(job);
        const FrameInput::Clock::time_point end = FrameInput::Clock::now();
        if (chosen_) effort_times_.add(chosen_->effort, end - chosen_->time);
        if (end > job.input.deadline) job.reasons |= DEFREC_REASON_OVERDUE;
        job.finish(DEFREC_OK, "");
        // Nobody waits for this. The arrays stay as they are until this thread computes another
        // frame.
        if (is_tracking_)
            std::copy(job.output.samples.begin(), job.output.samples.end(), last_->samples.begin());
        if (shows_cuts_) watch_for_cuts(job);
        if (may_grow_) plan_growth(job);
    } catch (const Error& error) {
        job.finish(error.status(), error.what());
    } catch (const std::bad_alloc&) {
        job.finish(DEFREC_ERROR_OUT_OF_MEMORY, "out of memory");
    } catch (const std::exception& error) {
        job.finish(DEFREC_ERROR_INTERNAL, error.what());
    }
}

void SurfaceFollower::cancel(TrackerJob& job) noexcept {
    if (ahead_ && ahead_->job == &job) ahead_.reset();
    job.finish(DEFREC_ERROR_STATE, "the tracker was destroyed before this frame was computed");
}

void SurfaceFollower::process(TrackerJob& job) {
    stale_.clear();
    rig_left_ = rig_monitor_.update({});
    job.rig_estimate = in_all(rig_left_, shift_);
    // The device begins while the host looks; frames in which there is nothing to observe are few.
    std::optional<ObservedFrame> frame;
    std::optional<Unseen> unseen = begin(job, frame);
    if (const auto* followed = unseen ? std::get_if<FollowedFrame>(&unseen->result) : nullptr)
        pipeline_.await_gray(*followed);
    else
        pipeline_.await_gray(*frame);
    check_images(job);
    // Of a view that stands still nothing is known of now: what both show together is of two times.
    // So is what an interlaced one shows, but its depth is better than none.
    const bool one_stands = (job.reasons & DEFREC_REASON_VIEW_LATE) != 0,
               of_two_times = one_stands || job.is_interlaced();
    if ((job.reasons & kUselessImages) != 0 || (of_two_times && !is_tracking_)) {
        take_back(unseen, frame);
        pipeline_.forget(std::move(*frame));
        if (!prepare_results(job)) return;
        forget_evidence(job);
        conclude(job, Verdict{}, true);
        return;
    }
    const bool captures = !of_two_times && (template_ == nullptr ||
                                            (job.input.flags & DEFREC_FRAME_CAPTURE_TEMPLATE) != 0);
    if (!captures && release_cut()) job.reasons |= DEFREC_REASON_CUT;
    if (!captures && grow()) job.reasons |= DEFREC_REASON_TEMPLATE_GREW;
    const uint32_t reasons = job.reasons;
    // A template keeps the depth that it was captured with: where its own frame shows that the rig
    // wants correction, it is captured again.
    for (int attempts_left = captures && corrects_rig_ ? 2 : 0;; --attempts_left) {
        if (captures) capture(job, *frame);
        if (!prepare_results(job)) return;
        bool uses_depth = !one_stands && (captures || !is_tracking_ || !is_depth_spoilt_);
        if (unseen && unseen->following.uses_depth != uses_depth) take_back(unseen, frame);
        Following following = unseen ? unseen->following
                                     : Following{.uses_depth = uses_depth,
                                                 .whole_map = !is_tracking_,
                                                 .effort = begin_effort(job)};
        Verdict verdict = unseen ? judge(job, frame, followed_of(std::move(*unseen)), following)
                                 : follow(job, frame, last_->motions, following);
        // The frame jumped to another part of the map than it was expected in.
        if (pipeline_.solved_part() &&
            (!verdict.found || !pipeline_.solved_all_seen(job.output.motions))) {
            following.whole_map = true;
            following.effort = begin_effort(job);
            verdict = follow(job, frame, last_->motions, following);
        }
        if (of_two_times) {
            last_rows_.clear();
            disparities_.skip_frame();
            verdict.degraded = true;
        } else {
            watch_rig(job, verdict, uses_depth);
        }
        is_depth_spoilt_ = !of_two_times && is_tracking_ && lag_spoils_depth(job);
        if (uses_depth && !captures && is_depth_spoilt_) {
            uses_depth = false;
            const uint32_t of_rig = verdict.reasons & kReasonsOfRig;
            following.uses_depth = false;
            following.effort = begin_effort(job);
            verdict = follow(job, frame, last_->motions, following);
            verdict.reasons |= of_rig;
            verdict.degraded = true;
        } else if (!captures && is_tracking_ && job.evidence.confirms_few() &&
                   wide_search_.is_due()) {
            const Chosen again = choose_effort(job);
            if (again.effort == Effort::kFull) {
                chosen_ = again;
                search_widely(job, frame, following, verdict);
            } else {
                verdict.reasons |= DEFREC_REASON_COARSE;
            }
        }
        if (!of_two_times) find_stale_parts(job, verdict);
        job.reasons |= verdict.reasons;
        if (!verdict.found && uses_depth) look_for_swapped_views(job, *frame);
        const bool is_corrected = corrects_rig_ && correct_rig();
        if (!is_corrected || attempts_left == 0) {
            conclude(job, verdict, uses_depth);
            return;
        }
        frame.reset();
        frame.emplace(pipeline_.observe(task_of(job)));
        job.reasons = reasons;
        --epoch_;  // it is the same template, made better
        --template_epoch_;
    }
}

// The device observes the frame, and follows it unless the host has to see it first: then frame is
// what was observed.
std::optional<SurfaceFollower::Unseen> SurfaceFollower::begin(TrackerJob& job,
                                                              std::optional<ObservedFrame>& frame) {
    if (ahead_ && ahead_->job == &job) {
        auto result = std::move(ahead_->result);
        ahead_.reset();
        if (const auto* failure = std::get_if<std::exception_ptr>(&result))
            std::rethrow_exception(*failure);
        frame.emplace(std::get<ObservedFrame>(std::move(result)));
    } else {
        if (job.template_to_set != nullptr) to_adopt_ = std::exchange(job.template_to_set, nullptr);
        if (to_adopt_ != nullptr) adopt_set_template(job);
    }
    if (can_follow_unseen(job)) return follow_unseen(job, frame);
    if (!frame) frame.emplace(pipeline_.observe(task_of(job)));
    return std::nullopt;
}

// Where that fails, this frame does, and those after it: never is another template followed in its
// place. But a frame that is captured, if it can be, is a template of its own.
void SurfaceFollower::adopt_set_template(const TrackerJob& job) {
    try {
        adopt(to_adopt_, false);
    } catch (const std::exception&) {
        if ((job.input.flags & DEFREC_FRAME_CAPTURE_TEMPLATE) == 0) throw;
        return;
    }
    frames_.end_template(*std::exchange(to_adopt_, nullptr));
}

// Queues the images of the next frame, if it was submitted, behind the work on this one, so that
// the device has something to do while the host concludes this one. A device that computes in this
// thread is done by now, and its results are not kept waiting. false: such a frame may still come.
bool SurfaceFollower::observe_ahead(const FollowedFrame& followed) {
    if (ahead_ || !pipeline_.can_observe() || pipeline_.done(followed, 0)) return true;
    const FrameQueue::Next next = frames_.next();
    if (next.job == nullptr) return !next.may_come;
    if (next.job->template_to_set != nullptr) return true;  // may change what stereo searches
    try {
        ahead_.emplace(Ahead{next.job, pipeline_.observe(task_of(*next.job))});
    } catch (const std::exception&) {
        ahead_.emplace(Ahead{next.job, std::current_exception()});
    }
    return true;
}

// Most frames are as expected: a device that works by itself goes on with theirs while the host
// still looks at the images. Not where more than the images decides how they are followed.
bool SurfaceFollower::can_follow_unseen(const TrackerJob& job) const {
    const bool captures = (job.input.flags & DEFREC_FRAME_CAPTURE_TEMPLATE) != 0;
    return is_tracking_ && !captures && !cut_ && growth_.rests() && pipeline_.can_follow_unseen();
}

// frame: empty where it is not yet observed. Where following fails it is observed after all: its
// images decide whether the failure matters.
SurfaceFollower::Unseen SurfaceFollower::follow_unseen(TrackerJob& job,
                                                       std::optional<ObservedFrame>& frame) {
    const Following following{
        .uses_depth = !is_depth_spoilt_, .whole_map = false, .effort = begin_effort(job)};
    try {
        prepare_results(job);
        const std::span<const defrec_motion> start(last_->motions);
        return {following, frame ? pipeline_.follow(std::move(*frame), start, following)
                                 : pipeline_.observe_and_follow(task_of(job), start, following)};
    } catch (const std::exception&) {
        const std::exception_ptr failure = std::current_exception();
        if (!frame) frame.emplace(pipeline_.observe(task_of(job)));
        return {following, failure};
    }
}

FollowedFrame SurfaceFollower::followed_of(Unseen unseen) {
    if (const auto* failure = std::get_if<std::exception_ptr>(&unseen.result))
        std::rethrow_exception(*failure);
    return std::get<FollowedFrame>(std::move(unseen.result));
}

// The frame is as if it had not been followed.
void SurfaceFollower::take_back(std::optional<Unseen>& unseen,
                                std::optional<ObservedFrame>& frame) {
    if (!unseen) return;
    if (auto* followed = std::get_if<FollowedFrame>(&unseen->result))
        frame.emplace(pipeline_.take_back(std::move(*followed)));
    unseen.reset();
    chosen_.reset();
}

void SurfaceFollower::check_images(TrackerJob& job) {
    constexpr size_t kParts = StandingBlocks::kParts;
    std::array<GraySums, kParts> sums[2];
    for_each_task(job.services()->own_threads(), 2 * kParts, [&](size_t task) {
        const size_t view = task / kParts, part = task % kParts;
        sums[view][part] = look_at(job, view, part);
    });
    ImageStatistics statistics[2];
    for (size_t view = 0; view < 2; ++view) {
        statistics[view] = image_statistics(sums[view]);
        blocks_[view].end_image();
        statistics[view].standing = blocks_[view].share();
    }
    job.reasons = stream_.reasons(job.frame, job.input.timestamp_ns, statistics[0], statistics[1]);
}

// Of the gray image as it was given, or where that lies in memory of the rectified one. The part's
// pixels come from memory once.
GraySums SurfaceFollower::look_at(const TrackerJob& job, size_t view, size_t part) {
    const uint8_t* gray = job.views[view].as<uint8_t>().data();
    const int32_t* map =
        is_in_memory(job, static_cast<int>(view)) ? rig_->map(static_cast<int>(view)) : nullptr;
    const GraySums sums =
        sum_gray(gray, rig_->width(), rig_->height(), blocks_[view].rows_of(part), map);
    blocks_[view].add_part(gray, part);
    return sums;
}

void SurfaceFollower::capture(TrackerJob& job, ObservedFrame& frame) {
    std::optional<TemplateData> data = pipeline_.capture(frame);
    if (!data) {
        job.reasons |= DEFREC_REASON_NO_DEPTH;
        if (pipeline_.views_look_swapped(frame)) job.reasons |= DEFREC_REASON_VIEWS_SWAPPED;
        return;
    }
    adopt(std::make_shared<const Template>(std::move(*data), job.services()), true);
    if (to_adopt_ != nullptr) frames_.end_template(*std::exchange(to_adopt_, nullptr));
}

// is_observed: it was captured from this very frame.
void SurfaceFollower::adopt(std::shared_ptr<const Template> surface, bool is_observed) {
    const TemplateData& data = surface->data();
    Surface made{SurfaceModel(data),
                 std::vector<defrec_motion>(data.nodes.size() / 3,
                                            DualQuaternion<float>::identity().store()),
                 std::vector<defrec_surface_sample>(data.vertices.size())};
    std::transform(data.vertices.begin(), data.vertices.end(), made.samples.begin(), at_rest);
    OutsideMotion outside(*surface);
    pipeline_.set_template(data);
    // Nothing fails from here on: the tracker has the old template or the new one.
    last_ = std::move(made);
    is_tracking_ = is_observed;
    last_rows_.clear();
    disparities_.reset();
    pieces_.reset(data.pieces(), is_observed);
    age_ = 0;
    ++epoch_;
    ++template_epoch_;
    growth_.reset();
    camera_.reset();
    outside_ = std::move(outside);
    cut_watch_.reset();
    cut_.reset();
    keep(std::move(surface));
}

void SurfaceFollower::keep(std::shared_ptr<const Template> surface) {
    if (has_body_) surface->start_body();
    const std::lock_guard lock(template_mutex_);
    template_ = std::move(surface);
}

// The surface is where it was, with more or other parts; motions: of its control points.
void SurfaceFollower::change_template(TemplateData changed, std::vector<defrec_motion> motions) {
    auto surface = std::make_shared<const Template>(std::move(changed), *template_);
    const TemplateData& data = surface->data();
    Surface made{SurfaceModel(data), std::move(motions), last_->samples};
    for (size_t i = made.samples.size(); i < data.vertices.size(); ++i)
        made.samples.push_back(moved(data.vertices[i], made.motions));
    OutsideMotion outside(*surface, outside_);
    pipeline_.set_template(data);
    last_ = std::move(made);
    disparities_.forget_vertices();
    outside_ = std::move(outside);
    ++template_epoch_;
    keep(std::move(surface));
}

// Releases what connects the sides of a cut that the frames before showed; false where there is
// none. Tissue that was about to join is fitted anew.
bool SurfaceFollower::release_cut() {
    if (!cut_) return false;
    change_template(release_across(template_->data(), *cut_), last_->motions);
    cut_.reset();
    cut_watch_.reset();
    growth_.reset();
    return true;
}

// Takes in the tissue that is to join with this frame; false where there is none.
bool SurfaceFollower::grow() {
    std::optional<Growth> growth = growth_.begin_frame();
    if (!growth) return false;
    std::vector<defrec_motion> motions = last_->motions;
    extend_motions(growth->data.nodes, growth->anchors, motions);
    change_template(std::move(growth->data), std::move(motions));
    growth_.joined(template_->data(), growth->anchors);
    return true;
}

// Makes room for the results with the present template; false, with the results there are, where
// there is none.
bool SurfaceFollower::prepare_results(TrackerJob& job) {
    job.surface = template_;
    if (template_ == nullptr) {
        job.state = DEFREC_INITIALISING;
        job.epoch = 0;
        job.template_epoch = 0;
        job.age = 0;
        return false;
    }
    // A job that was last used with another template has arrays of another size.
    const TemplateData& data = template_->data();
    job.memory.fit(data);
    job.vertices.resize(3 * data.vertices.size());
    job.normals.resize(3 * data.vertices.size());
    job.node_positions.resize(data.nodes.size());
    job.motions.resize(data.nodes.size() / 3);
    placed_.reserve(data.vertices.size());
    expect_room_for_samples(job);
    return true;
}

// If the frame is followed from here on.
SurfaceFollower::Chosen SurfaceFollower::choose_effort(const TrackerJob& job) const {
    const FrameInput::Clock::time_point now = FrameInput::Clock::now();
    return {effort_times_.choose(job.input.deadline - now), now};
}

Effort SurfaceFollower::begin_effort(const TrackerJob& job) {
    chosen_ = choose_effort(job);
    return chosen_->effort;
}

Verdict SurfaceFollower::follow(TrackerJob& job, std::optional<ObservedFrame>& frame,
                                std::span<const defrec_motion> start, const Following& following) {
    if (FrontImages* images = growth_.images()) pipeline_.read_front(*frame, *images);
    return judge(job, frame, pipeline_.follow(std::move(*frame), start, following), following);
}

Verdict SurfaceFollower::judge(TrackerJob& job, std::optional<ObservedFrame>& frame,
                               FollowedFrame followed, const Following& following) {
    begin_measuring(job);
    frame.emplace(finish(job, std::move(followed)));
    job.announce_end();
    measure(job);
    if (const FrontImages* images = growth_.images()) pipeline_.check(*images);
    job.evidence = weigh_evidence(job.output, vertex_evidence_, patch_px2_);
    Verdict verdict = classify(template_->data(), job.evidence, is_tracking_, following.uses_depth);
    verdict.reasons |= reasons_of(following.effort);
    verdict.degraded |= following.effort != Effort::kFull;
    return verdict;
}

// Waits for the device. The next frame may come meanwhile; and shortly before the device is
// expected to be done those are woken who have something to do then: the threads that measure the
// frame, and who waits for the job.
ObservedFrame SurfaceFollower::finish(TrackerJob& job, FollowedFrame followed) {
    using Time = std::chrono::nanoseconds;
    constexpr Time kWaking = std::chrono::microseconds(45),
                   kLongestNap = std::chrono::microseconds(500),
                   kShort = std::chrono::milliseconds(1);
    const std::shared_ptr<const Services> services = job.services();
    const FrameInput::Clock::time_point start = FrameInput::Clock::now();
    const auto since_start = [start]() -> Time { return FrameInput::Clock::now() - start; };
    // A wait that ends too early may cost a call of the driver. Each looks for a while before it
    // sleeps: many short ones would keep a core busy through a long frame.
    const Time limit = pipeline_.deadline(), usual = std::min(usual_wait_, limit),
               last_part = usual / 8;
    // A long wait is slept through up to its last part, a nap at a time: on a device that many
    // trackers share, cores that look for its end are missing elsewhere.
    const Time asleep = last_part > platform::sleep_error() ? usual - last_part : Time::zero();
    Time look = std::chrono::microseconds(200), wake = usual - kWaking;
    bool looks = true, wakes = wake > Time::zero();
    for (Time waited{0};; waited = since_start()) {
        looks = looks && look < limit && !observe_ahead(followed);
        if (wakes && waited >= wake) {
            wakes = false;
            if (const Services* helpers = services->own_threads())
                helpers->rouse(kMaxVertexThreads - 1);
            job.announce_end();
        }
        const bool naps = waited < asleep;
        if (!looks && !wakes && !naps) break;
        const Time until = std::min(looks ? look : limit, wakes ? wake : limit),
                   left = std::max(until - waited, Time::zero());
        if (pipeline_.done(followed, naps ? 0 : static_cast<uint64_t>(left.count()))) break;
        if (naps)
            std::this_thread::sleep_for(std::min({left, asleep - waited, last_part, kLongestNap}));
        if (until == look && (!naps || since_start() >= look)) look *= 2;
    }
    ObservedFrame frame = pipeline_.finish(std::move(followed));
    // Beyond a short wait, one frame that took long is not yet usual.
    const Time counted = std::min(since_start(), std::max(2 * usual_wait_, kShort));
    usual_wait_ += (counted - usual_wait_) / 4;
    return frame;
}

// Tissue that is blurred or has moved far shows few of its patches near where they are expected;
// coarser images, searched farther round what was found so far, show more. Where an instrument
// hides them they show fewer, and what was found before is kept.
void SurfaceFollower::search_widely(TrackerJob& job, std::optional<ObservedFrame>& frame,
                                    Following following, Verdict& verdict) {
    const Evidence before = job.evidence;
    job.memory.keep(before_);
    const std::vector<defrec_motion> start(job.output.motions.begin(), job.output.motions.end());
    following.searches_widely = true;
    const Verdict wide = follow(job, frame, verdict.found ? start : last_->motions, following);
    const bool is_better = wide.found && job.evidence.confirmed_share() > before.confirmed_share();
    wide_search_.end(is_better);
    if (is_better) {
        const uint32_t kept = verdict.reasons & (DEFREC_REASON_LOW_CONTRAST | kReasonsOfRig);
        verdict = wide;
        verdict.reasons |= kept;
        verdict.degraded = true;
        return;
    }
    job.memory.restore(before_);
    job.evidence = before;
    begin_measuring(job);
    measure(job);
    if (job.input.samples != nullptr)
        pipeline_.leave_samples(job.output.samples, *job.input.samples);
}

// Of a frame that is lost: without depth, although the exchanged views would have some.
void SurfaceFollower::look_for_swapped_views(TrackerJob& job, ObservedFrame& frame) {
    if ((job.reasons & DEFREC_REASON_NO_DEPTH) == 0 || !swapped_search_.is_due()) return;
    const bool look_swapped = pipeline_.views_look_swapped(frame);
    swapped_search_.end(look_swapped);
    if (look_swapped) job.reasons |= DEFREC_REASON_VIEWS_SWAPPED;
}

void SurfaceFollower::watch_rig(TrackerJob& job, Verdict& verdict, bool uses_depth) {
    if (!verdict.found || !watches_rig_) return;
    // Nothing moves in the picture of the frame before, and it has been measured.
    if (!is_frozen(job)) {
        rig_monitor_ = rig_after_;
        rig_left_ = rig_left_after_;
        last_rows_.swap(rows_);
        job.rig_estimate = in_all(rig_left_, shift_);
        if (is_tracking_ && uses_depth && !rig_monitor_.is_late() &&
            chosen_->effort == Effort::kFull)
            std::swap(disparities_, disparities_after_);
        else
            disparities_.skip_frame();
    }
    const bool is_misaligned = rig_monitor_.is_out_of_calibration() || disparities_.slip_px() != 0;
    if (rig_monitor_.is_late()) verdict.reasons |= DEFREC_REASON_VIEW_LATE;
    if (is_misaligned) verdict.reasons |= DEFREC_REASON_CALIBRATION;
    verdict.degraded |= rig_monitor_.is_late() || is_misaligned;
}

// Of a picture a part of which stands still while the rest moves on, that part says nothing.
void SurfaceFollower::find_stale_parts(const TrackerJob& job, Verdict& verdict) {
    constexpr double kMinShare = 0.05;  // of the vertices in the image, to be worth a reason
    // Two repeated frames come of a change of the frame rate, or of a frame that was lost.
    constexpr uint32_t kMostRepeated = 2;
    frozen_frames_ = is_frozen(job) ? frozen_frames_ + 1 : 0;
    if (frozen_frames_ > kMostRepeated) {
        stale_.set_all(job.output.samples.size());
        verdict.degraded = true;
    }
    if (!verdict.found || !is_tracking_ || is_frozen(job)) return;
    stale_.find(*rig_, blocks_, {is_in_memory(job, 0), is_in_memory(job, 1)}, last_->samples,
                job.output.samples);
    if (stale_.share() < kMinShare) return;
    verdict.reasons |= DEFREC_REASON_FROZEN;
    verdict.degraded = true;
}

// Whether depth errs more by what moved between the views' times than it does when the left image
// alone tells where the surface is.
bool SurfaceFollower::lag_spoils_depth(const TrackerJob& job) const {
    constexpr double kErrorOfOneView = 1.5;  // mm
    if (!rig_monitor_.is_late()) return false;
    const defrec_camera& camera = template_->data().camera;
    const double lag = rig_left_.lag_frames;
    double squares = 0;
    size_t count = 0;
    for (size_t i = 0; i < job.output.samples.size(); ++i) {
        if (job.output.samples[i].observation == DEFREC_OUTSIDE) continue;
        const defrec_surface_sample& now = job.output.samples[i];
        const double depth = lag * depth_per_px(camera, now.position[2]);
        squares += depth * depth * squared_step(camera, last_->samples[i], now);
        ++count;
    }
    return squares > kErrorOfOneView * kErrorOfOneView * static_cast<double>(count);
}

// Takes what the monitor has found into the right view's map; false where that is too little.
bool SurfaceFollower::correct_rig() {
    if (!rig_monitor_.wants_correction()) return false;
    shift_.offset_px += rig_left_.vertical_offset_px;
    shift_.roll += radians(rig_left_.roll_deg);
    shift_.ratio += rig_left_.focal_ratio - 1;
    ahead_.reset();  // it was observed without
    pipeline_.shift_right_view(shift_);
    rig_monitor_.reset();
    return true;
}

// After the job has ended, which must hear of no failure any more.
void SurfaceFollower::watch_for_cuts(const TrackerJob& job) noexcept {
    if (cut_) return;
    try {
        cut_ =
            cut_watch_.add_frame(template_->data(), job.output.samples, job.lateral.is_confirmed);
    } catch (const std::exception&) {
        cut_watch_.reset();  // the gap, if there is one, is still there in later frames
    }
}

void SurfaceFollower::plan_growth(const TrackerJob& job) noexcept {
    try {
        growth_.plan(template_->data(), job.output);
    } catch (const std::exception&) {
        growth_.end_lost_frame();  // later frames show the same tissue
    }
}

}  // namespace defrec
