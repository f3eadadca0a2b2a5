#include "sdk/tracking/job.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <new>

#include "sdk/base/os/spin.hpp"
#include "sdk/base/util/wait_end.hpp"
#include "sdk/body/body_slot.hpp"
#include "sdk/tracking/points/lift_pixels.hpp"
#include "sdk/tracking/points/prepared_targets.hpp"

namespace defrec {
TrackerJob::TrackerJob(std::shared_ptr<JobMonitor> job_monitor,
                       const std::shared_ptr<const Device>& device, uint64_t pixels,
                       bool keep_disparity, bool grows)
    : monitor(std::move(job_monitor)),
      views{HostMemory(device, pixels), HostMemory(device, pixels)},
      disparity(ContextAllocator<int16_t>(monitor->device.services())),
      sigma(ContextAllocator<float>(monitor->device.services())),
      views_in_device{views[0].as_buffer(), views[1].as_buffer()},
      memory(device, keep_disparity ? pixels : 0),
      device_(device),
      pixels_(pixels),
      grows_(grows) {
    // Only the tracker's thread may ask a plugin for memory.
    if (device->has_host_memory()) ignore = HostMemory(device, pixels);
}

void TrackerJob::make_room(const FrameInput& coming) {
    if (coming.ignore.pixels != nullptr && ignore.size() == 0)
        ignore = HostMemory(device_, pixels_);
    if (coming.given_disparity.values != nullptr) disparity.resize(pixels_);
    if (coming.given_disparity.sigma != nullptr) sigma.resize(pixels_);
}

void TrackerJob::make_room(const TemplateData& data) {
    memory.fit(data);
    const size_t vertices = data.vertices.size();
    const uint64_t needed = vertices * sizeof(defrec_surface_sample);
    if (input.samples != nullptr && input.samples->size() < needed)
        fail(DEFREC_ERROR_ARGUMENT, "samples: the memory has ", input.samples->size(), " bytes, ",
             needed, " are needed for ", vertices, " vertices");
}

void JobMonitor::give_up(const char* call) {
    const Error error = device.give_up(call);
    const std::lock_guard lock(mutex);
    if (is_given_up) return;
    failure = error.what();
    is_given_up = true;
}

defrec_status TrackerJob::wait(uint64_t timeout_ns) {
    using Clock = DeviceWatch::Clock;
    const Clock::time_point end = wait_end(timeout_ns);
    std::unique_lock lock(monitor->mutex);
    const auto await = [&](const auto& reached) {
        const auto outcome = monitor->watch->wait_until(changed_, lock, end, reached);
        if (outcome != DeviceWatch::Outcome::kStuck) return outcome == DeviceWatch::Outcome::kDone;
        give_up(lock);
        return true;
    };
    if (!await([this] { return phase >= JobPhase::kEnding || has_ended(); })) return DEFREC_TIMEOUT;
    if (!has_ended()) {
        lock.unlock();
        constexpr std::chrono::nanoseconds kSpin =
            std::chrono::milliseconds(1);  // longer than what is left takes
        spin_until(std::min(kSpin, std::chrono::nanoseconds(end - Clock::now())),
                   [this] { return phase == JobPhase::kDone; });
        lock.lock();
        if (!await([this] { return has_ended(); })) return DEFREC_TIMEOUT;
    }
    return phase == JobPhase::kDone ? status : DEFREC_ERROR_DEVICE_LOST;
}

void TrackerJob::give_up(std::unique_lock<std::mutex>& lock) {
    const char* call = monitor->watch->stuck_in();
    lock.unlock();  // a log of the application is called
    monitor->give_up(call != nullptr ? call : "a call that took too long");
    lock.lock();
}

std::string TrackerJob::error_text() const {
    const std::lock_guard lock(monitor->mutex);
    return phase == JobPhase::kDone ? error_text_ : monitor->failure;
}

void TrackerJob::announce_end() {
    const std::lock_guard lock(monitor->mutex);
    if (phase == JobPhase::kEnding) return;
    phase = JobPhase::kEnding;
    changed_.notify_all();
}

void TrackerJob::finish(defrec_status result_status, const char* text) noexcept {
    for (FrameImage* image : {&input.views[0], &input.views[1], &input.ignore})
        image->memory.reset();
    input.samples.reset();
    const std::lock_guard lock(monitor->mutex);
    // Who asked was told that it is lost, and it is not to come back.
    if (monitor->is_given_up) return;
    status = result_status;
    try {
        error_text_ = text;
    } catch (const std::bad_alloc&) {
        error_text_ = "out of memory";  // short enough to need none
    }
    phase = JobPhase::kDone;
    changed_.notify_all();
}

void TrackerJob::release() {
    std::unique_lock lock(monitor->mutex);
    const auto outcome = monitor->watch->wait_until(
        changed_, lock, DeviceWatch::Clock::time_point::max(), [this] { return has_ended(); });
    if (outcome == DeviceWatch::Outcome::kStuck) give_up(lock);
    if (phase != JobPhase::kDone) return;  // a thread that is left behind may come back to it
    result.surface.reset();
    carrier_.reset();
    phase = JobPhase::kFree;
}

// Under the mutex, as the queue lets go: else both could see the other, and one be the last.
bool TrackerJob::leave(std::shared_ptr<Job>& own) {
    const std::shared_ptr<JobMonitor> held = monitor;
    const std::lock_guard lock(held->mutex);
    if (own.use_count() == 1) return false;
    own.reset();
    return true;
}

void TrackerJob::expect_done() const {
    const std::lock_guard lock(monitor->mutex);
    if (phase != JobPhase::kDone && monitor->is_given_up)
        fail(DEFREC_ERROR_DEVICE_LOST, monitor->failure);
    if (phase != JobPhase::kDone)
        fail(DEFREC_ERROR_STATE, "the frame is not done; wait for its job first");
    if (status < 0) fail(status, error_text_);
}

void TrackerJob::describe(defrec_result& out) const {
    expect_done();
    const FrameOutput& output = memory.output;
    result.describe(out);
    out.timestamp_ns = input.timestamp_ns;
    out.frame = frame;
    out.features = output.summary->features;
    std::copy(output.times.begin(), output.times.end(), out.times);
    out.time_count = output.time_count;
    out.disparity = output.disparity.empty() ? nullptr : output.disparity.data();
    out.device_id = monitor->device.description().id.c_str();
    if (result.surface == nullptr) return;
    out.landmark_matches = output.matches.data();
    out.patch_observations = output.observations.data();
}

void TrackerJob::expect_surface() const {
    expect_done();
    if (result.surface == nullptr) fail(DEFREC_ERROR_STATE, "there is no template yet");
}

const FrameResult& TrackerJob::surface_result() const {
    expect_surface();
    return result;
}

void TrackerJob::lift_points(const double* uv, size_t count, double* xyz, uint8_t* found) const {
    expect_surface();
    if (result.state != DEFREC_LOST) {
        lift_pixels(*result.surface,
                    {result.vertices, result.motions,
                     grows_ ? memory.output.disparity : std::span<const int16_t>(), result.pieces},
                    {uv, 2 * count}, {xyz, 3 * count}, {found, count});
        return;
    }
    std::fill_n(xyz, 3 * count, 0.0);
    std::fill_n(found, count, uint8_t{0});
}

CarryingSurface TrackerJob::carrying_surface() const {
    return {*result.surface,
            result.motions,
            result.vertices,
            result.confidence,
            result.state == DEFREC_LOST,
            grows_,
            result.known};
}

void TrackerJob::carry(const double* template_xyz, size_t count, const Carried& carried) const {
    const std::shared_ptr<const Services> lent = services();
    const Services* helpers = lent->own_threads();
    if (count >= PreparedSets::kFewest && count <= PreparedSets::kMost) {
        const auto set =
            monitor->prepared.find_or_prepare(result.surface, template_xyz, count, helpers);
        return carrier_.carry(carrying_surface(), set->view(), set->body, helpers, carried);
    }
    // Few points need no memory; of very many, as many are prepared at a time as threads can share.
    constexpr size_t kFew = 32, kBlock = 8192;
    const std::shared_ptr<const Body> body = result.surface->body().body();
    std::array<PreparedPoint, kFew> few;
    std::array<DeepPoint, kFew> few_deep;
    std::vector<PreparedPoint> many(count > kFew ? std::min(count, kBlock) : 0);
    std::vector<DeepPoint> many_deep(many.size());
    const std::span<PreparedPoint> room = count > kFew ? std::span(many) : std::span(few);
    const std::span<DeepPoint> deep_room =
        count > kFew ? std::span(many_deep) : std::span(few_deep);
    for (size_t begin = 0; begin < count; begin += room.size()) {
        const std::span<PreparedPoint> points = room.first(std::min(room.size(), count - begin));
        const std::span<DeepPoint> deep = deep_room.first(
            prepare_points(*result.surface, template_xyz + 3 * begin, helpers, points));
        prepare_deep_points(*result.surface, body.get(), helpers, points, deep);
        const auto of_block = [&](size_t i, const CarriedPoint& point) {
            carried(begin + i, point);
        };
        carrier_.carry(carrying_surface(), {points, deep}, body, helpers, std::ref(of_block));
    }
}

namespace {

// The caller's arrays that moved points are written to; all but xyz may be null.
struct MovedPointArrays {
    double *xyz, *covariance;
    uint8_t* status;
    double* expected_error_mm;

    void operator()(size_t i, const CarriedPoint& point) const {
        const auto& [place, at_point] = point;
        xyz[3 * i] = place.x;
        xyz[3 * i + 1] = place.y;
        xyz[3 * i + 2] = place.z;
        if (covariance != nullptr) std::copy_n(at_point.covariance, 6, covariance + 6 * i);
        if (status != nullptr) status[i] = at_point.status;
        if (expected_error_mm != nullptr) expected_error_mm[i] = at_point.expected_error;
    }
};

}  // namespace

void TrackerJob::warp_points(const double* template_xyz, size_t count, double* xyz,
                             uint8_t* point_status, double* expected_error_mm) const {
    expect_surface();
    const MovedPointArrays arrays{xyz, nullptr, point_status, expected_error_mm};
    carry(template_xyz, count, std::cref(arrays));
}

void TrackerJob::point_covariances(const double* template_xyz, size_t count, double* covariance,
                                   uint8_t* point_evidence) const {
    expect_surface();
    const auto write = [&](size_t i, const CarriedPoint& point) {
        std::copy_n(point.confidence.covariance, 6, covariance + 6 * i);
        if (point_evidence != nullptr) point_evidence[i] = point.confidence.evidence;
    };
    carry(template_xyz, count, std::ref(write));
}

void TrackerJob::move_targets(const PreparedTargets& targets, double* xyz, double* covariance,
                              uint8_t* point_status, double* expected_error_mm) const {
    expect_surface();
    if (!result.surface->descends_from(targets.surface()))
        fail(DEFREC_ERROR_ARGUMENT, "the targets were made for another template");
    const auto prepared = targets.prepared(result.surface, services()->own_threads());
    const MovedPointArrays arrays{xyz, covariance, point_status, expected_error_mm};
    carrier_.carry(carrying_surface(), prepared->view(), prepared->body, services()->own_threads(),
                   std::cref(arrays));
}

}  // namespace defrec
