// See pipeline.hpp.
#include "sdk/tracking/pipeline.hpp"

#include <algorithm>

#include "sdk/contract/pixel_format.hpp"
#include "sdk/tracking/check_output.hpp"
#include "sdk/tracking/make_stage.hpp"

namespace defrec {
namespace {

// The image as a buffer: the application's own, or this one with the pixels in it; nullptr where
// there is no image.
const DeviceBuffer* upload(Queue& queue, const FrameImage& image, const DeviceBuffer& buffer) {
    if (image.memory != nullptr) return image.memory.get();
    if (image.pixels == nullptr) return nullptr;
    queue.write_in_place(buffer, image.pixels, buffer.size());
    return &buffer;
}

template <class T>
void read_all(Queue& queue, const DeviceBuffer& buffer, std::vector<T>& values) {
    queue.read(buffer, values.data(), values.size() * sizeof(T));
}

}  // namespace

void ObservedFrame::End::operator()(Observation* observation) const noexcept {
    if (std::exchange(observation->has_work, false)) pipeline->drain();
    observation->is_taken = false;
}

Pipeline::Pipeline(std::shared_ptr<const Rig> rig, std::shared_ptr<Device> device,
                   const TrackerSettings& settings)
    : rig_(std::move(rig)),
      device_(std::move(device)),
      settings_(settings),
      widest_range_(
          settings.disparities != 0
              ? SearchRange{static_cast<uint32_t>(settings.min_disparity), settings.disparities}
              : widest_search_range(rig_->camera(), rig_->width(), settings.min_depth_mm)),
      queue_(device_) {
    const uint32_t row = rig_->width() * bytes_per_pixel(settings_.format);
    rectify_ = make_rectify(row);
    if (settings_.memory_stride != row) rectify_memory_ = make_rectify(settings_.memory_stride);
    upload_maps();
    stereo_ = make_stereo(widest_range_);

    auto orb = make_params<defrec_orb_params>();
    orb.width = rig_->width();
    orb.height = rig_->height();
    orb.capacity = settings_.max_features;
    orb_ = make_stage<DEFREC_STAGE_ORB>(device_, orb);

    observations_.push_back(make_observation());
    if (settings_.frames_in_flight == 1 || settings_.timed) return;
    observations_.push_back(make_observation());
    uploads_.emplace(device_);
}

Observation Pipeline::make_observation() const {
    const uint64_t pixels = uint64_t{rig_->width()} * rig_->height();
    Observation o;
    for (int view = 0; view < 2; ++view) {
        o.raw[view] = DeviceBuffer(device_, pixels * bytes_per_pixel(settings_.format));
        o.gray[view] = DeviceBuffer(device_, pixels);
        o.mask[view] = DeviceBuffer(device_, pixels);
    }
    o.ignore = DeviceBuffer(device_, pixels);
    o.disparity = DeviceBuffer(device_, pixels * sizeof(int16_t));
    o.feature_count = DeviceBuffer(device_, sizeof(uint32_t));
    o.features = DeviceBuffer(device_, uint64_t{settings_.max_features} * sizeof(defrec_feature));
    return o;
}

std::unique_ptr<DeviceStage> Pipeline::make_rectify(uint32_t source_stride) const {
    auto params = make_params<defrec_rectify_params>();
    params.format = settings_.format;
    params.source_width = params.width = rig_->width();
    params.source_height = params.height = rig_->height();
    params.source_stride = source_stride;
    return make_stage<DEFREC_STAGE_RECTIFY>(device_, params);
}

std::unique_ptr<DeviceStage> Pipeline::make_stereo(const SearchRange& range) const {
    auto params = make_params<defrec_stereo_params>();
    params.width = rig_->width();
    params.height = rig_->height();
    params.min_disparity = static_cast<int32_t>(range.min_disparity);
    params.disparities = range.disparities;
    return make_stage<DEFREC_STAGE_STEREO>(device_, params);
}

void Pipeline::upload_maps() {
    for (int view = 0; view < 2; ++view) {
        if (rig_->map(view) == nullptr) continue;
        map_[view] = DeviceBuffer(device_, rig_->map_bytes());
        queue_.write(map_[view], rig_->map(view), rig_->map_bytes());
    }
}

void Pipeline::shift_right_view(const Rig::ViewShift& shift) {
    const std::vector<int32_t> map = rig_->shifted_right_map(shift);
    if (!map_[1]) map_[1] = DeviceBuffer(device_, rig_->map_bytes());
    queue_.write(map_[1], map.data(), rig_->map_bytes());
    queue_.finish();
}

bool Pipeline::can_observe() const {
    return std::any_of(observations_.begin(), observations_.end(),
                       [](const Observation& o) { return !o.is_taken; });
}

ObservedFrame Pipeline::take_observation(const FrameTask& task) {
    const auto free = std::find_if(observations_.begin(), observations_.end(),
                                   [](const Observation& o) { return !o.is_taken; });
    if (free == observations_.end())
        fail(DEFREC_ERROR_INTERNAL, observations_.size(),
             " frames are observed already, as many as there are buffers for");
    free->is_taken = true;
    free->has_work = true;
    return ObservedFrame({&*free, {this}}, task, settings_.timed ? &queue_ : nullptr);
}

ObservedFrame Pipeline::observe(const FrameTask& task) {
    const bool is_second = std::any_of(observations_.begin(), observations_.end(),
                                       [](const Observation& o) { return o.is_taken; });
    FrameOutput& output = task.output;
    output.time_count = 0;
    output.summary->features = 0;
    ObservedFrame frame = take_observation(task);
    Observation& o = *frame.observation_;
    rectify(frame, is_second ? *uploads_ : queue_);
    stereo_->enqueue(queue_, {&o.gray[0], &o.gray[1], &o.mask[0], &o.mask[1]},
                     {&o.disparity, nullptr});
    frame.timer_.end("stereo");
    orb_->enqueue(queue_, {&o.gray[0], &o.mask[0]}, {&o.feature_count, &o.features});
    queue_.read(o.feature_count, &output.summary->features, sizeof output.summary->features);
    if (settings_.keep_disparity)
        queue_.read(o.disparity, output.disparity.data(), output.disparity.size_bytes());
    frame.timer_.end("orb");
    queue_.signal();
    return frame;
}

void Pipeline::rectify(ObservedFrame& frame, Queue& uploads) {
    Observation& o = *frame.observation_;
    const FrameInput& input = frame.task_.input;
    const DeviceBuffer* ignored = upload(uploads, input.ignore, o.ignore);
    const DeviceBuffer* raw[2] = {upload(uploads, input.views[0], o.raw[0]),
                                  upload(uploads, input.views[1], o.raw[1])};
    if (&uploads != &queue_) uploads.finish();  // the queue does not wait for another
    frame.timer_.end("upload");
    bool reads_gray = false;
    for (size_t view = 0; view < 2; ++view) {
        const bool in_memory = input.views[view].memory != nullptr;
        DeviceStage& rectify =
            in_memory && rectify_memory_ != nullptr ? *rectify_memory_ : *rectify_;
        rectify.enqueue(
            queue_, {raw[view], map_[view] ? &map_[view] : nullptr, view == 0 ? ignored : nullptr},
            {&o.gray[view], &o.mask[view]});
        if (in_memory) queue_.read(o.gray[view], frame.task_.gray[view], o.gray[view].size());
        reads_gray |= in_memory;
    }
    if (reads_gray) frame.gray_point_ = queue_.signal();
    frame.timer_.end("rectify");
}

void Pipeline::await_gray(const ObservedFrame& frame) {
    if (frame.gray_point_ != 0) queue_.wait(frame.gray_point_);
}

void Pipeline::forget(ObservedFrame frame) {
    queue_.finish();
    frame.observation_->has_work = false;
    frame.task_.output.summary->features = 0;
}

void Pipeline::read_front(const ObservedFrame& frame, FrontImages& images) {
    const Observation& o = *frame.observation_;
    const size_t pixels = size_t{rig_->width()} * rig_->height();
    images.gray.resize(pixels);
    images.mask.resize(pixels);
    images.disparity.resize(pixels);
    images.features.resize(settings_.max_features);
    read_all(queue_, o.gray[0], images.gray);
    read_all(queue_, o.mask[0], images.mask);
    read_all(queue_, o.disparity, images.disparity);
    read_all(queue_, o.features, images.features);
    queue_.read(o.feature_count, &images.feature_count, sizeof images.feature_count);
}

void Pipeline::check(const FrontImages& images) const {
    check_front(images, rig_->width(), rig_->height(), settings_.max_features, widest_range_);
}

void Pipeline::check(const FrameOutput& output, const TemplateData& data) const {
    check_output(output, data, settings_.max_features);
}

CaptureInput Pipeline::capture_input(const FrontImages& images) const {
    CaptureInput input;
    input.width = rig_->width();
    input.height = rig_->height();
    input.camera = rig_->camera();
    input.gray = images.gray.data();
    input.mask = images.mask.data();
    input.disparity = images.disparity.data();
    input.features = std::span(images.features).first(images.feature_count);
    input.vertex_spacing_px = settings_.vertex_spacing_px;
    input.node_spacing_px = settings_.node_spacing_px;
    input.max_patches = settings_.max_patches;
    return input;
}

std::optional<TemplateData> Pipeline::capture(ObservedFrame& frame) {
    read_front(frame, host_);
    queue_.finish();
    check(host_);
    return capture_template(capture_input(host_));
}

bool Pipeline::views_look_swapped(ObservedFrame& frame) {
    Observation& o = *frame.observation_;
    std::vector<int16_t>& disparity = host_.disparity;
    disparity.resize(size_t{rig_->width()} * rig_->height());
    const auto coverage = [&](int first, int second) {
        stereo_->enqueue(queue_, {&o.gray[first], &o.gray[second], &o.mask[first], &o.mask[second]},
                         {&o.disparity, nullptr});
        read_all(queue_, o.disparity, disparity);
        queue_.finish();
        const auto known =
            std::count_if(disparity.begin(), disparity.end(), [](int16_t d) { return d > 0; });
        return static_cast<double>(known) / static_cast<double>(disparity.size());
    };
    const double exchanged = coverage(1, 0), given = coverage(0, 1);
    return exchanged > 2 * kMinimumCoverage && exchanged > 3 * given;
}

void Pipeline::set_template(const TemplateData& data) {
    auto stages = std::make_unique<TemplateStages>(device_, queue_, *rig_, settings_, data);
    if (settings_.disparities == 0)
        stereo_ = make_stereo(narrowed_search_range(data, widest_range_));
    template_ = std::move(stages);
}

FollowedFrame Pipeline::follow(ObservedFrame frame, std::span<const defrec_motion> start,
                               const Following& following) {
    if (template_ == nullptr) fail(DEFREC_ERROR_INTERNAL, "there is no template to follow");
    frame.observation_->has_work = true;
    template_->enqueue(queue_, *frame.observation_, start, following,
                       frame.task_.input.samples.get(), frame.timer_, frame.task_.output);
    const uint64_t end = queue_.signal();
    return FollowedFrame(std::move(frame), end);
}

ObservedFrame Pipeline::finish(FollowedFrame followed) {
    queue_.wait(followed.end_point_);
    ObservedFrame& frame = followed.frame_;
    frame.observation_->has_work = false;
    frame.timer_.end("download");
    return std::move(frame);
}

void Pipeline::leave_samples(std::span<const defrec_surface_sample> samples,
                             const DeviceBuffer& memory) {
    try {
        queue_.write(memory, samples.data(), samples.size_bytes());
        queue_.finish();
    } catch (...) {
        drain();
        throw;
    }
}

void Pipeline::drain() noexcept {
    for (Queue* queue : {&queue_, uploads_ ? &*uploads_ : nullptr}) try {
            if (queue != nullptr) queue->finish();
        } catch (const std::exception&) {
            // A queue that fails to wait delivers nothing either.
        }
}

}  // namespace defrec
