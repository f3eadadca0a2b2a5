#include "sdk/tracking/tracker.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <optional>
#include <thread>

#include "backends/shared/motion.hpp"
#include "sdk/base/platform.hpp"
#include "sdk/base/shared_loop.hpp"
#include "sdk/base/spin.hpp"
#include "sdk/contract/pixel_format.hpp"
#include "sdk/tracking/job.hpp"
#include "sdk/tracking/pipeline.hpp"

namespace defrec {
namespace {

constexpr uint32_t kAllStages = (1u << DEFREC_STAGE_COUNT_V1) - 1;

std::string describe(const defrec_camera& camera) {
    return concat("fx ", camera.fx, ", fy ", camera.fy, ", cx ", camera.cx, ", cy ", camera.cy,
                  " px and baseline ", camera.baseline_mm, " mm");
}

defrec_surface_sample at_rest(const defrec_surface_point& point) {
    defrec_surface_sample sample{};
    std::copy(std::begin(point.position), std::end(point.position), sample.position);
    std::copy(std::begin(point.normal), std::end(point.normal), sample.normal);
    sample.observation = DEFREC_NO_DEPTH;
    return sample;
}

}  // namespace

class Tracker::Impl {
  public:
    Impl(std::shared_ptr<Context> context, std::shared_ptr<const Rig> rig,
         const defrec_tracker_desc& desc)
        : context_(std::move(context)),
          rig_(std::move(rig)),
          settings_(complete_settings(desc, *rig_)),
          channels_(bytes_per_pixel(settings_.format)),
          device_(context_->open_device(desc.device_id, kAllStages)),
          pipeline_(context_, rig_, device_, settings_) {
        const uint64_t pixels = uint64_t{rig_->width()} * rig_->height();
        for (uint32_t i = 0; i < settings_.frames_in_flight; ++i)
            jobs_.push_back(std::make_shared<TrackerJob>(monitor_, device_, pixels * channels_,
                                                         pixels, settings_.keep_disparity));
        order_.resize(settings_.frames_in_flight);
        worker_ = platform::start_thread([this] { work(); });
    }

    ~Impl() {
        {
            const std::lock_guard lock(monitor_->mutex);
            stopping_ = true;
            arrived_.notify_all();
        }
        worker_.join();
    }

    std::shared_ptr<Job> submit(FrameInput input) {
        std::shared_ptr<TrackerJob> job = reserve(input.timestamp_ns);
        const uint64_t row = uint64_t{rig_->width()} * channels_;
        const KeptImage images[] = {{input.views[0], row, job->views[0].as<uint8_t>()},
                                    {input.views[1], row, job->views[1].as<uint8_t>()},
                                    {input.ignore, rig_->width(), job->ignore.as<uint8_t>()}};
        // A device that computes on the processor has better use for the pool.
        keep_pixels(images, rig_->height(), copying_,
                    device_->has_host_memory() ? &context_->services() : nullptr);
        job->input = std::move(input);

        const std::lock_guard lock(monitor_->mutex);
        last_timestamp_ = job->input.timestamp_ns;
        job->frame = submitted_;
        job->template_to_set = std::exchange(template_to_set_, nullptr);
        job->phase = JobPhase::kQueued;
        order_[submitted_ % order_.size()] = job.get();
        ++submitted_;
        arrived_.notify_all();
        return job;
    }

    std::shared_ptr<const Template> current_template() const {
        const std::lock_guard lock(monitor_->mutex);
        if (template_to_set_ != nullptr) return template_to_set_;
        if (surface_ == nullptr)
            fail(DEFREC_ERROR_STATE,
                 "the tracker has no template yet; submit a frame and wait for it, or set one");
        return surface_;
    }

    void set_template(std::shared_ptr<const Template> surface) {
        const TemplateData& data = surface->data();
        const defrec_camera& camera = rig_->camera();
        if (data.width != rig_->width() || data.height != rig_->height())
            fail(DEFREC_ERROR_ARGUMENT, "the template was taken from images of ", data.width, "x",
                 data.height, ", the rig has ", rig_->width(), "x", rig_->height());
        const auto differ = [&](double a, double b) { return std::abs(a - b) > 1e-6 * camera.fx; };
        if (differ(data.camera.fx, camera.fx) || differ(data.camera.fy, camera.fy) ||
            differ(data.camera.cx, camera.cx) || differ(data.camera.cy, camera.cy) ||
            std::abs(data.camera.baseline_mm - camera.baseline_mm) > 1e-6 * camera.baseline_mm)
            fail(DEFREC_ERROR_ARGUMENT, "the template was taken with ", describe(data.camera),
                 ", the rig has ", describe(camera));
        const std::lock_guard lock(monitor_->mutex);
        template_to_set_ = std::move(surface);
    }

    std::shared_ptr<const DeviceBuffer> import_memory(uint32_t kind, void* address,
                                                      uint64_t size) const {
        return std::make_shared<const DeviceBuffer>(
            DeviceBuffer::import(device_, kind, address, size));
    }
    bool can_use(const DeviceBuffer& memory) const { return memory.device() == device_; }

    uint32_t format() const { return settings_.format; }
    uint32_t memory_stride() const { return settings_.memory_stride; }
    const Rig& rig() const { return *rig_; }

  private:
    std::shared_ptr<TrackerJob> reserve(int64_t timestamp_ns) {
        const std::lock_guard lock(monitor_->mutex);
        if (submitted_ > 0 && timestamp_ns <= last_timestamp_)
            fail(DEFREC_ERROR_ARGUMENT, "timestamp_ns is ", timestamp_ns, ", the frame before had ",
                 last_timestamp_, "; it must grow");
        for (const std::shared_ptr<TrackerJob>& job : jobs_)
            if (job->phase == JobPhase::kFree) {
                announced_ = submitted_ + 1;
                arrived_.notify_all();
                return job;
            }
        fail(DEFREC_ERROR_BUSY, "all ", jobs_.size(),
             " places in the queue are taken; release a job first");
    }

    // Sleeps until a frame is announced, and wakes up while its pixels are copied, where it helps.
    std::unique_lock<std::mutex> await_frame(uint64_t next) {
        constexpr std::chrono::nanoseconds kSpin = std::chrono::microseconds(50),
                                           kCopying = std::chrono::milliseconds(1);
        const auto announced = [&] { return stopping_ || announced_ > next; };
        const auto arrived = [&] { return stopping_ || submitted_ > next; };
        spin_until(kSpin, announced);
        std::unique_lock lock(monitor_->mutex);
        arrived_.wait(lock, announced);
        if (!arrived()) {
            lock.unlock();
            spin_until(kCopying, [&] {
                copying_.help();
                return arrived();
            });
            lock.lock();
            arrived_.wait(lock, arrived);
        }
        return lock;
    }

    void work() {
        for (uint64_t next = 0;; ++next) {
            TrackerJob* job = nullptr;
            bool cancelled = false;
            {
                std::unique_lock lock = await_frame(next);
                if (submitted_ <= next) return;
                job = order_[next % order_.size()];
                job->phase = JobPhase::kRunning;
                cancelled = stopping_;
            }
            if (cancelled && job == ahead_) pipeline_.drain();
            if (cancelled)
                job->finish(DEFREC_ERROR_STATE,
                            "the tracker was destroyed before this frame was computed");
            else
                compute(*job);
        }
    }

    void compute(TrackerJob& job) {
        try {
            follow_frame(job);
            job.finish(DEFREC_OK, "");
            // Nobody waits for this. The arrays stay as they are until this thread computes another
            // frame.
            if (tracking_)
                last_samples_.assign(job.output.samples.begin(), job.output.samples.end());
        } catch (const Error& error) {
            fail_job(job, error.status(), error.what());
        } catch (const std::bad_alloc&) {
            fail_job(job, DEFREC_ERROR_OUT_OF_MEMORY, "out of memory");
        } catch (const std::exception& error) {
            fail_job(job, DEFREC_ERROR_INTERNAL, error.what());
        }
    }
    void fail_job(TrackerJob& job, defrec_status status, const char* text) {
        pipeline_.drain();
        job.finish(status, text);
    }

    void follow_frame(TrackerJob& job) {
        // The device begins while the host looks; frames in which there is nothing to see are few.
        begin(job);
        look_at_images(job);
        const bool blind = (job.reasons & (DEFREC_REASON_DARK | DEFREC_REASON_SATURATED |
                                           DEFREC_REASON_ONE_EYE)) != 0;
        if (blind)
            pipeline_.forget_observation(job.output);
        else if (surface_ == nullptr || (job.input.flags & DEFREC_FRAME_CAPTURE_TEMPLATE) != 0)
            capture(job);
        job.surface = surface_;
        if (surface_ == nullptr) {
            job.state = DEFREC_INITIALISING;
            job.epoch = 0;
            job.age = 0;
            return;
        }
        fit_sizes(job);
        expect_room_for_samples(job);
        if (blind) forget_evidence(job);
        const bool found = !blind && follow(job);
        conclude(job, found);
    }

    void begin(TrackerJob& job) {
        if (std::exchange(ahead_, nullptr) == &job) {
            if (ahead_failure_ != nullptr)
                std::rethrow_exception(std::exchange(ahead_failure_, nullptr));
            pipeline_.use_ahead();
            return;
        }
        if (job.template_to_set != nullptr)
            adopt(std::exchange(job.template_to_set, nullptr), false);
        observe(job, &Pipeline::observe);
    }

    template <class Observe>
    void observe(TrackerJob& job, Observe with) {
        job.reasons = 0;
        job.output.time_count = 0;
        job.output.summary->features = 0;
        (pipeline_.*with)(job.input,
                          {job.views[0].as<uint8_t>().data(), job.views[1].as<uint8_t>().data()},
                          job.output);
    }

    // Queues the images of frame `next`, if it was submitted, behind the work on the one before, so
    // that the device has something to do while the host concludes that. A device that computes in
    // this thread is done by now, and its results are not kept waiting. false: such a frame may
    // still come.
    bool look_ahead(uint64_t next) {
        if (ahead_ != nullptr || !pipeline_.can_observe_ahead() || pipeline_.done(0)) return true;
        TrackerJob* job = nullptr;
        {
            const std::lock_guard lock(monitor_->mutex);
            if (stopping_) return true;
            if (submitted_ <= next) return false;
            job = order_[next % order_.size()];
        }
        if (job->template_to_set != nullptr) return true;  // may change what stereo searches
        ahead_ = job;
        try {
            observe(*job, &Pipeline::observe_ahead);
        } catch (const std::exception&) {
            ahead_failure_ = std::current_exception();
        }
        return true;
    }

    // Exposure, and whether the stream stands still.
    void look_at_images(TrackerJob& job) {
        pipeline_.await_gray();
        const ImageStatistics left = statistics_of(job, 0), right = statistics_of(job, 1);
        if (left.dark() || right.dark()) job.reasons |= DEFREC_REASON_DARK;
        if (left.dark() != right.dark()) job.reasons |= DEFREC_REASON_ONE_EYE;
        if (left.saturated() || right.saturated()) job.reasons |= DEFREC_REASON_SATURATED;
        if (std::max(left.deviation, right.deviation) < 1.5)
            job.reasons |= DEFREC_REASON_NO_TEXTURE;
        if (job.frame > 0 && left.hash == last_hash_[0] && right.hash == last_hash_[1])
            job.reasons |= DEFREC_REASON_FROZEN;
        last_hash_[0] = left.hash;
        last_hash_[1] = right.hash;
        if (job.frame > 0) {
            const int64_t step = since(last_frame_time_, job.input.timestamp_ns);
            if (job.frame > 1 && usual_step_ > 0 && step - usual_step_ > usual_step_)
                job.reasons |= DEFREC_REASON_GAP;
            usual_step_ = usual_step_ == 0 ? step : usual_step_ + (step - usual_step_) / 8;
        }
        last_frame_time_ = job.input.timestamp_ns;
    }

    // Timestamps may lie farther apart than their type can say.
    static int64_t since(int64_t earlier, int64_t later) {
        const uint64_t step = static_cast<uint64_t>(later) - static_cast<uint64_t>(earlier);
        return static_cast<int64_t>(std::min<uint64_t>(step, INT64_MAX));
    }

    // Of the raw image, or where that lies in memory of the rectified one.
    ImageStatistics statistics_of(const TrackerJob& job, int view) const {
        const uint8_t* pixels = job.views[view].as<uint8_t>().data();
        if (job.input.views[static_cast<size_t>(view)].memory == nullptr)
            return image_statistics(pixels, rig_->width(), rig_->height(), channels_);
        return image_statistics(pixels, rig_->width(), rig_->height(), 1, rig_->map(view));
    }

    void capture(TrackerJob& job) {
        std::optional<TemplateData> data = pipeline_.capture();
        if (!data) {
            job.reasons |= DEFREC_REASON_NO_DEPTH;
            if (pipeline_.views_look_swapped()) job.reasons |= DEFREC_REASON_EYES_SWAPPED;
            return;
        }
        adopt(std::make_shared<const Template>(std::move(*data)), true);
    }

    // seen: it was captured from this very frame.
    void adopt(std::shared_ptr<const Template> surface, bool seen) {
        const TemplateData& data = surface->data();
        SurfaceModel model(data);
        std::vector<defrec_motion> motions(data.nodes.size() / 3,
                                           DualQuaternion<float>::identity().store());
        std::vector<defrec_surface_sample> samples(data.vertices.size());
        std::transform(data.vertices.begin(), data.vertices.end(), samples.begin(), at_rest);
        pipeline_.set_template(surface);
        // Nothing fails from here on: the tracker has the old template or the new one.
        model_ = std::move(model);
        last_motions_ = std::move(motions);
        last_samples_ = std::move(samples);
        tracking_ = seen;
        age_ = 0;
        ++epoch_;
        const std::lock_guard lock(monitor_->mutex);
        surface_ = std::move(surface);
    }

    // A job that was last used with another template has arrays of another size.
    void fit_sizes(TrackerJob& job) {
        const TemplateData& data = surface_->data();
        job.memory.fit(data);
        job.vertices.resize(3 * data.vertices.size());
        job.normals.resize(3 * data.vertices.size());
        job.node_positions.resize(data.nodes.size());
    }

    static void expect_room_for_samples(const TrackerJob& job) {
        const uint64_t needed = job.output.samples.size() * sizeof(defrec_surface_sample);
        if (job.input.samples != nullptr && job.input.samples->size() < needed)
            fail(DEFREC_ERROR_ARGUMENT, "samples: the memory has ", job.input.samples->size(),
                 " bytes, ", needed, " are needed for ", job.output.samples.size(), " vertices");
    }

    // Nothing was searched in a frame of no use: a place in the queue must not show what an earlier
    // frame had.
    static void forget_evidence(TrackerJob& job) {
        job.evidence = {};
        defrec_match none{};
        none.feature = -1;
        none.distance = none.second = 256;
        std::fill(job.output.matches.begin(), job.output.matches.end(), none);
        std::fill(job.output.observations.begin(), job.output.observations.end(),
                  defrec_patch_observation{});
    }

    bool follow(TrackerJob& job) {
        pipeline_.follow(last_motions_, job.input.samples.get(), job.output);
        // A wait that ends too early may cost a call of the driver. Each looks for a while before
        // it sleeps: many short ones would keep a core busy through a long frame.
        uint64_t look_again_ns = 200000;
        while (!look_ahead(job.frame + 1) && !pipeline_.done(look_again_ns)) look_again_ns *= 2;
        pipeline_.finish(job.output);
        job.announce_end();
        job.evidence = weigh_evidence(surface_->data(), job.output);
        const Verdict verdict = classify(surface_->data(), job.evidence, tracking_);
        job.reasons |= verdict.reasons;
        degraded_ = verdict.degraded;
        return verdict.found;
    }

    void conclude(TrackerJob& job, bool found) {
        if (found) {
            constexpr float kFastMm = 5;
            if (tracking_ && moved_farther(last_samples_, job.output.samples, kFastMm))
                job.reasons |= DEFREC_REASON_FAST_MOTION;
            job.state = !tracking_  ? DEFREC_RELOCALISED
                        : degraded_ ? DEFREC_DEGRADED
                                    : DEFREC_TRACKING;
            if (!tracking_) ++epoch_;
            last_motions_.assign(job.output.motions.begin(), job.output.motions.end());
            age_ = 0;
        } else {
            job.state = DEFREC_LOST;
            std::copy(last_motions_.begin(), last_motions_.end(), job.output.motions.begin());
            std::copy(last_samples_.begin(), last_samples_.end(), job.output.samples.begin());
            if (job.input.samples != nullptr)
                pipeline_.leave_samples(job.output.samples, *job.input.samples);
            ++age_;
        }
        tracking_ = found;
        job.epoch = epoch_;
        job.age = age_;
        estimate_confidence(*model_, job.output.samples, !found, age_, job.confidence);
        fit_rigid_motion(*model_, job.output.samples, job.rigid_motion);
        split_samples(job.output.samples, job.vertices, job.normals);
        const std::vector<float>& nodes = surface_->data().nodes;
        for (size_t i = 0; i < job.output.motions.size(); ++i)
            store3(apply(DualQuaternion<double>::load(job.output.motions[i]),
                         load3<double>(&nodes[3 * i])),
                   &job.node_positions[3 * i]);
    }

    std::shared_ptr<Context> context_;
    std::shared_ptr<const Rig> rig_;
    TrackerSettings settings_;
    uint32_t channels_;
    std::shared_ptr<Device> device_;

    std::shared_ptr<JobMonitor> monitor_ = std::make_shared<JobMonitor>();
    std::vector<std::shared_ptr<TrackerJob>> jobs_;
    Pipeline pipeline_;   // goes before the jobs, whose memory a failed frame's work may still use
    SharedLoop copying_;  // of the pixels of the frame that is being submitted
    std::condition_variable arrived_;  // with the monitor's mutex, for the worker
    // Written under the monitor's mutex.
    std::atomic<uint64_t> submitted_ = 0,
                          announced_ = 0;  // frames; announced before their pixels are copied
    std::atomic<bool> stopping_ = false;
    // Under the monitor's mutex.
    std::vector<TrackerJob*> order_;  // a ring: frame n at n % size
    int64_t last_timestamp_ = 0;
    std::shared_ptr<const Template> template_to_set_;
    std::shared_ptr<const Template> surface_;  // written by the worker

    // The worker's own.
    TrackerJob* ahead_ = nullptr;  // observed while the frame before it was followed
    std::exception_ptr ahead_failure_;
    std::vector<defrec_motion> last_motions_;
    std::vector<defrec_surface_sample> last_samples_;  // of the frame the surface was last found in
    std::optional<SurfaceModel> model_;                // of the template
    uint64_t last_hash_[2] = {0, 0};
    int64_t last_frame_time_ = 0, usual_step_ = 0;
    bool tracking_ = false, degraded_ = false;
    uint32_t epoch_ = 0, age_ = 0;

    std::thread worker_;
};

Tracker::Tracker(std::shared_ptr<Context> context, std::shared_ptr<const Rig> rig,
                 const defrec_tracker_desc& desc)
    : impl_(std::make_unique<Impl>(std::move(context), std::move(rig), desc)) {}
Tracker::~Tracker() = default;
std::shared_ptr<Job> Tracker::submit(FrameInput input) { return impl_->submit(std::move(input)); }
std::shared_ptr<const DeviceBuffer> Tracker::import_memory(uint32_t kind, void* address,
                                                           uint64_t size) const {
    return impl_->import_memory(kind, address, size);
}
bool Tracker::can_use(const DeviceBuffer& memory) const { return impl_->can_use(memory); }
std::shared_ptr<const Template> Tracker::current_template() const {
    return impl_->current_template();
}
void Tracker::set_template(std::shared_ptr<const Template> surface) {
    impl_->set_template(std::move(surface));
}
uint32_t Tracker::format() const { return impl_->format(); }
uint32_t Tracker::memory_stride() const { return impl_->memory_stride(); }
const Rig& Tracker::rig() const { return impl_->rig(); }

}  // namespace defrec
