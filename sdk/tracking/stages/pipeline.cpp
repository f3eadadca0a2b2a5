// See pipeline.hpp.
#include "sdk/tracking/stages/pipeline.hpp"

#include <algorithm>
#include <cstdlib>

#include "sdk/base/util/median.hpp"
#include "sdk/template/decisions.hpp"
#include "sdk/template/texture_level.hpp"
#include "sdk/tracking/decisions/disparity.hpp"
#include "sdk/tracking/decisions/stages.hpp"
#include "sdk/tracking/stages/check_output.hpp"
#include "sdk/tracking/stages/coarse_search.hpp"
#include "sdk/tracking/stages/make_stage.hpp"

namespace defrec {
namespace {

using decisions::StageParameters;

constexpr uint32_t feature_halvings(uint32_t width, uint32_t height) {
    uint32_t halvings = 0;
    while (halvings < kOrbMaxHalvings &&
           width >> (halvings + 1) >= StageParameters::kMinFeatureWidth &&
           height >> (halvings + 1) >= StageParameters::kMinFeatureHeight)
        ++halvings;
    return halvings;
}

// The image as a buffer: the application's own, the pixels as they are, or this one, which is made
// where it is empty, with the pixels in it; nullptr where there is no image.
const DeviceBuffer* upload(Queue& queue, const FrameImage& image, DeviceBuffer& buffer,
                           uint64_t size) {
    if (image.memory != nullptr) return image.memory.get();
    if (image.pixels == nullptr) return nullptr;
    if (image.pixels_in_device != nullptr) return image.pixels_in_device;
    if (!buffer) buffer = DeviceBuffer(queue.device(), size);
    queue.write_in_place(buffer, image.pixels, size);
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
      plausible_range_(
          settings.disparities != 0
              ? SearchRange{static_cast<uint32_t>(settings.min_disparity), settings.disparities}
              : plausible_search_range(rig_->camera(), rig_->width(), settings.min_depth_mm)),
      widest_range_(settings.disparities != 0 ? plausible_range_
                                              : widest_search_range(plausible_range_)),
      range_(widest_range_),
      queue_(device_) {
    rectify_ = make_rectify(DEFREC_FORMAT_GRAY8, rig_->width());
    upload_maps();
    stereo();
    log_range();

    auto orb = make_params<defrec_orb_params>();
    orb.width = rig_->width();
    orb.height = rig_->height();
    orb.capacity = settings_.max_features;
    orb.levels = StageParameters::kFeatureLevels;
    orb.halvings = feature_halvings(rig_->width(), rig_->height());
    orb_ = make_stage<DEFREC_STAGE_ORB>(device_, orb);

    observations_.push_back(make_observation());
    if (settings_.frames_in_flight == 1 || settings_.timed) return;
    observations_.push_back(make_observation());
    uploads_.emplace(device_);
}

Observation Pipeline::make_observation() const {
    const uint64_t pixels = uint64_t{rig_->width()} * rig_->height();
    Observation o;
    // Else most devices take the frame's own memory.
    const bool uploads = !device_->copies_at_once();
    for (int view = 0; view < 2; ++view) {
        if (uploads) o.raw[view] = DeviceBuffer(device_, pixels);
        o.gray[view] = DeviceBuffer(device_, pixels);
        o.mask[view] = DeviceBuffer(device_, pixels);
    }
    if (uploads) o.ignore = DeviceBuffer(device_, pixels);
    o.disparity = DeviceBuffer(device_, pixels * sizeof(int16_t));
    o.feature_count = DeviceBuffer(device_, sizeof(uint32_t));
    o.features = DeviceBuffer(device_, uint64_t{settings_.max_features} * sizeof(defrec_feature));
    return o;
}

std::unique_ptr<DeviceStage> Pipeline::make_rectify(uint32_t format, uint32_t source_stride) const {
    auto params = make_params<defrec_rectify_params>();
    params.format = format;
    params.source_width = params.width = rig_->width();
    params.source_height = params.height = rig_->height();
    params.source_stride = source_stride;
    return make_stage<DEFREC_STAGE_RECTIFY>(device_, params);
}

// Pixels of the host were kept as gray values.
DeviceStage& Pipeline::rectify_of(const FrameImage& view) {
    if (view.memory == nullptr) return *rectify_;
    if (rectify_memory_ == nullptr)
        rectify_memory_ = make_rectify(settings_.format, settings_.memory_stride);
    return *rectify_memory_;
}

DeviceStage& Pipeline::stereo() {
    if (stereo_ == nullptr) {
        auto params = make_params<defrec_stereo_params>();
        params.width = rig_->width();
        params.height = rig_->height();
        params.min_disparity = static_cast<int32_t>(range_.min_disparity);
        params.disparities = range_.disparities;
        params.smooth_passes = StageParameters::kSmoothPasses;
        params.edge = StageParameters::kDepthEdge;
        if (large_windows_)
            params.radius = params.refine_radius = StageParameters::kLargeStereoRadius;
        stereo_ = make_stage<DEFREC_STAGE_STEREO>(device_, params);
    }
    return *stereo_;
}

// The stage for one search goes before that for the other is made: both are large.
void Pipeline::search(const SearchRange& range, bool by_large_windows) {
    if (range == range_ && by_large_windows == large_windows_) return;
    const SearchRange before = std::exchange(range_, range);
    const bool were_large = std::exchange(large_windows_, by_large_windows);
    stereo_.reset();
    try {
        stereo();
    } catch (...) {
        range_ = before;
        large_windows_ = were_large;
        throw;
    }
    log_range();
}

void Pipeline::log_range() const {
    device_->services().log(DEFREC_LOG_INFO, "sdk",
                            concat("stereo searches ", describe(range_, rig_->camera()),
                                   large_windows_ ? ", with large windows: texture is faint" : "")
                                .c_str());
}

SearchRange Pipeline::find_range(const ObservedFrame& frame) {
    if (plausible_range_ == widest_search_range(plausible_range_)) return widest_range_;
    const Observation& o = *frame.observation_;
    auto &gray = looked_gray_, &mask = looked_mask_;
    for (int view = 0; view < 2; ++view) {
        gray[view].resize(size_t{rig_->width()} * rig_->height());
        mask[view].resize(gray[view].size());
        read_all(queue_, o.gray[view], gray[view]);
        read_all(queue_, o.mask[view], mask[view]);
    }
    queue_.finish();
    const std::optional<SeenDisparities> seen =
        coarse_search({rig_->width(), rig_->height(), {gray[0], gray[1]}, {mask[0], mask[1]}},
                      plausible_range_.disparities);
    return seen ? placed_search_range(plausible_range_, *seen) : widest_range_;
}

// The disparities that a template is captured from. again: where those of before were.
void Pipeline::search_for_template(ObservedFrame& frame, uint32_t texture_level, bool again) {
    if (frame.task_.input.disparity.given()) return;
    const bool finds_range = !again && settings_.disparities == 0;
    const SearchRange range = finds_range ? find_range(frame) : range_;
    const bool by_large_windows = is_faint(texture_level),
               is_same = range == range_ && by_large_windows == large_windows_;
    // Frames that were observed beside a template were searched where that was.
    if (is_same && (template_ == nullptr || !finds_range)) return;
    queue_.finish();
    search(range, by_large_windows);
    if (finds_range) widest_range_ = range;
    measure_again(frame);
}

void Pipeline::measure_again(ObservedFrame& frame) {
    Observation& o = *frame.observation_;
    enqueue_stereo(o);
    const FrameOutput& output = frame.task_.output;
    if (settings_.keep_disparity)
        queue_.read(o.disparity, output.disparity.data(), output.disparity.size_bytes());
}

void Pipeline::enqueue_stereo(Observation& o, int first, int second) {
    stereo().enqueue(queue_, {&o.gray[first], &o.gray[second], &o.mask[first], &o.mask[second]},
                     {&o.disparity, nullptr});
    o.searched_end = range_.min_disparity + range_.disparities;
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
    task.output.time_count = 0;
    task.output.summary->features = 0;
    return ObservedFrame({&*free, {this}}, task, settings_.timed ? &queue_ : nullptr);
}

ObservedFrame Pipeline::observe(const FrameTask& task) {
    ObservedFrame frame = take_observation(task);
    rectify(frame, upload_images(frame));
    find_disparity_and_features(frame);
    read_observed(frame);
    frame.timer_.end("orb");
    queue_.signal();
    return frame;
}

// Copies before the first stage and behind the last: between two they would keep a device from
// taking the stages as one.
RegisteredFrame Pipeline::observe_and_follow(const FrameTask& task,
                                             std::span<const defrec_motion> start,
                                             const RegistrationPlan& plan) {
    expect_template();
    ObservedFrame frame = take_observation(task);
    const Uploaded images = upload_images(frame);
    template_->start(queue_, start, plan);
    rectify(frame, images);
    find_disparity_and_features(frame);
    frame.timer_.end("orb");
    const uint32_t times = task.output.time_count;
    template_->enqueue(queue_, *frame.observation_, plan, task.input.samples.get(), frame.timer_,
                       task.output);
    read_observed(frame);
    const uint64_t end = queue_.signal();
    return RegisteredFrame(std::move(frame), end, times);
}

Pipeline::Uploaded Pipeline::upload_images(ObservedFrame& frame) {
    const auto taken = std::count_if(observations_.begin(), observations_.end(),
                                     [](const Observation& each) { return each.is_taken; });
    Queue& uploads = taken > 1 ? *uploads_ : queue_;
    Observation& o = *frame.observation_;
    const FrameInput& input = frame.task_.input;
    const uint64_t pixels = o.gray[0].size();
    const DeviceBuffer* ignored = upload(uploads, input.ignore, o.ignore, pixels);
    const Uploaded images{{upload(uploads, input.views[0], o.raw[0], pixels),
                           upload(uploads, input.views[1], o.raw[1], pixels)},
                          ignored};
    if (input.disparity.given()) write_given_disparity(frame, uploads);
    if (&uploads != &queue_) uploads.finish();  // the queue does not wait for another
    frame.timer_.end("upload");
    return images;
}

void Pipeline::rectify(ObservedFrame& frame, const Uploaded& images) {
    Observation& o = *frame.observation_;
    const FrameInput& input = frame.task_.input;
    bool reads_gray = false;
    for (size_t view = 0; view < 2; ++view) {
        const bool in_memory = input.views[view].memory != nullptr;
        rectify_of(input.views[view])
            .enqueue(queue_,
                     {images.views[view], map_[view] ? &map_[view] : nullptr,
                      view == 0 ? images.ignored : nullptr},
                     {&o.gray[view], &o.mask[view]});
        if (in_memory) queue_.read(o.gray[view], frame.task_.gray[view], o.gray[view].size());
        reads_gray |= in_memory;
    }
    if (reads_gray) frame.gray_point_ = queue_.signal();
    frame.timer_.end("rectify");
}

void Pipeline::write_given_disparity(const ObservedFrame& frame, Queue& queue) {
    const DeviceBuffer& disparity = frame.observation_->disparity;
    queue.write_in_place(disparity, frame.task_.input.disparity.values, disparity.size());
}

void Pipeline::find_disparity(ObservedFrame& frame) {
    if (frame.task_.input.disparity.given()) return write_given_disparity(frame, queue_);
    enqueue_stereo(*frame.observation_);
}

void Pipeline::find_disparity_and_features(ObservedFrame& frame) {
    Observation& o = *frame.observation_;
    if (!frame.task_.input.disparity.given()) {  // else it came with the images
        find_disparity(frame);
        frame.timer_.end("stereo");
    }
    orb_->enqueue(queue_, {&o.gray[0], &o.mask[0]}, {&o.feature_count, &o.features});
}

void Pipeline::read_observed(ObservedFrame& frame) {
    Observation& o = *frame.observation_;
    FrameOutput& output = frame.task_.output;
    queue_.read(o.feature_count, &output.summary->features, sizeof output.summary->features);
    if (settings_.keep_disparity)
        queue_.read(o.disparity, output.disparity.data(), output.disparity.size_bytes());
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
    const KeptDisparity& given = frame.task_.input.disparity;
    images.given_sigma_px = given.given() ? given.sigma_px : 0;
    images.searched_end = o.searched_end;
    images.mask.resize(pixels);
    images.disparity.resize(pixels);
    images.features.resize(settings_.max_features);
    read_gray(frame, images.gray);
    read_all(queue_, o.mask[0], images.mask);
    read_all(queue_, o.disparity, images.disparity);
    read_all(queue_, o.features, images.features);
    queue_.read(o.feature_count, &images.feature_count, sizeof images.feature_count);
}

void Pipeline::read_gray(const ObservedFrame& frame, std::vector<uint8_t>& gray) {
    gray.resize(size_t{rig_->width()} * rig_->height());
    read_all(queue_, frame.observation_->gray[0], gray);
}

void Pipeline::check(const FrontImages& images) const {
    check_front(images, rig_->width(), rig_->height(), settings_.max_features);
}

void Pipeline::check(const FrameOutput& output, const TemplateData& data) const {
    check_output(output, data, settings_.max_features);
}

CaptureInput Pipeline::capture_input(const FrontImages& images, uint32_t texture_level) const {
    CaptureInput input;
    input.width = rig_->width();
    input.height = rig_->height();
    input.camera = rig_->camera();
    input.gray = images.gray.data();
    input.mask = images.mask.data();
    input.disparity = images.disparity.data();
    input.disparity_sigma_px = images.given_sigma_px;
    input.features = std::span(images.features).first(images.feature_count);
    input.vertex_spacing_px = settings_.vertex_spacing_px;
    input.node_spacing_px = settings_.node_spacing_px;
    input.max_patches = settings_.max_patches;
    input.texture_level = texture_level;
    return input;
}

bool Pipeline::any_wrong_record(const FrameOutput& output, const TemplateData& data,
                                ArrayPart part) const {
    return defrec::any_wrong_record(output, data, settings_.max_features, part);
}

std::optional<TemplateData> Pipeline::capture(ObservedFrame& frame, bool again) {
    const SearchRange range = range_, widest = widest_range_;
    const bool were_large = large_windows_;
    read_gray(frame, host_.gray);
    queue_.finish();
    const uint32_t level = texture_level(host_.gray.data(), rig_->width(), rig_->height());
    search_for_template(frame, level, again);
    read_front(frame, host_);
    queue_.finish();
    check(host_);
    std::optional<TemplateData> data = capture_template(capture_input(host_, level));
    if (data) {
        host_ = {};  // rarely needed again
    } else if (template_ != nullptr) {
        search(range, were_large);
        widest_range_ = widest;
    }
    return data;
}

Pipeline::IgnoredDepth Pipeline::look_behind_mask(ObservedFrame& frame) {
    Observation& o = *frame.observation_;
    const FrameInput& input = frame.task_.input;
    const size_t pixels = size_t{rig_->width()} * rig_->height();
    auto &with_mask = looked_mask_[0], &without = looked_mask_[1];
    std::vector<int16_t>& disparity = host_.disparity;
    with_mask.resize(pixels);
    without.resize(pixels);
    disparity.resize(pixels);
    const DeviceBuffer* left = upload(queue_, input.views[0], o.raw[0], pixels);
    read_all(queue_, o.mask[0], with_mask);
    queue_.finish();
    rectify_of(input.views[0])
        .enqueue(queue_, {left, map_[0] ? &map_[0] : nullptr, nullptr}, {&o.gray[0], &o.mask[0]});
    enqueue_stereo(o);
    read_all(queue_, o.mask[0], without);
    read_all(queue_, o.disparity, disparity);
    queue_.write(o.mask[0], with_mask.data(), pixels);
    find_disparity(frame);
    queue_.finish();
    size_t known = 0, ignored = 0;
    for (size_t i = 0; i < pixels; ++i) {
        if (disparity[i] <= 0) continue;
        ++known;
        if (with_mask[i] == 0 && without[i] != 0) ++ignored;
    }
    return {static_cast<double>(known) / static_cast<double>(pixels),
            static_cast<double>(ignored) / static_cast<double>(std::max<size_t>(known, 1))};
}

bool Pipeline::views_look_swapped(ObservedFrame& frame) {
    if (frame.task_.input.disparity.given()) return false;  // of views that are as they should be
    Observation& o = *frame.observation_;
    std::vector<int16_t>& disparity = host_.disparity;
    disparity.resize(size_t{rig_->width()} * rig_->height());
    const auto coverage = [&](int first, int second) {
        enqueue_stereo(o, first, second);
        read_all(queue_, o.disparity, disparity);
        queue_.finish();
        const auto known =
            std::count_if(disparity.begin(), disparity.end(), [](int16_t d) { return d > 0; });
        return static_cast<double>(known) / static_cast<double>(disparity.size());
    };
    const double exchanged = coverage(1, 0), given = coverage(0, 1);
    using decisions::SearchRange;
    return exchanged > SearchRange::kSwappedCoverage * decisions::TemplateSurface::kMinCoverage &&
           exchanged > SearchRange::kSwappedFactor * given;
}

std::optional<double> Pipeline::compare_given_disparity(ObservedFrame& frame) {
    Observation& o = *frame.observation_;
    const int16_t* given = frame.task_.input.disparity.values;
    std::vector<int16_t>& measured = host_.disparity;
    measured.resize(size_t{rig_->width()} * rig_->height());
    enqueue_stereo(o);
    read_all(queue_, o.disparity, measured);
    find_disparity(frame);
    queue_.finish();
    std::vector<double> differences;
    for (size_t i = 0; i < measured.size(); ++i)
        if (measured[i] != DEFREC_DISPARITY_NONE && given[i] != DEFREC_DISPARITY_NONE)
            differences.push_back(std::abs(measured[i] - given[i]) / double{DEFREC_DISPARITY_ONE});
    if (static_cast<double>(differences.size()) <
        decisions::TemplateSurface::kMinCoverage * static_cast<double>(measured.size()))
        return std::nullopt;
    return median(std::move(differences));
}

void Pipeline::set_template(const TemplateData& data) {
    auto stages = std::make_unique<TemplateStages>(queue_, *rig_, settings_, data);
    search(settings_.disparities == 0 ? narrowed_search_range(data, widest_range_) : range_,
           data.is_faint());
    template_ = std::move(stages);
}

void Pipeline::forget_template() {
    template_.reset();
    search(settings_.disparities == 0 ? widest_range_ : range_, false);
}

void Pipeline::expect_template() const {
    if (template_ == nullptr) fail(DEFREC_ERROR_INTERNAL, "there is no template to follow");
}

RegisteredFrame Pipeline::follow(ObservedFrame&& frame, std::span<const defrec_motion> start,
                                 const RegistrationPlan& plan) {
    expect_template();
    FrameOutput& output = frame.task_.output;
    const uint32_t times = output.time_count;
    frame.observation_->has_work = true;
    try {
        template_->start(queue_, start, plan);
        frame.timer_.start();
        template_->enqueue(queue_, *frame.observation_, plan, frame.task_.input.samples.get(),
                           frame.timer_, output);
        const uint64_t end = queue_.signal();
        return RegisteredFrame(std::move(frame), end, times);
    } catch (...) {
        drain();
        frame.observation_->has_work = false;
        output.time_count = times;
        throw;
    }
}

bool Pipeline::can_follow_speculatively() const {
    return !settings_.timed && !device_->copies_at_once() && template_ != nullptr &&
           !template_->has_region();
}

ObservedFrame Pipeline::take_back(RegisteredFrame registered) {
    const uint32_t times = registered.times_before_;
    ObservedFrame frame = finish(std::move(registered));
    frame.task_.output.time_count = times;
    return frame;
}

ObservedFrame Pipeline::finish(RegisteredFrame registered) {
    queue_.wait(registered.end_point_);
    ObservedFrame& frame = registered.frame_;
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
