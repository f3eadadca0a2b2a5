#include "sdk/tracking/pipeline.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/base/check_ranges.hpp"

namespace defrec {
namespace {

template <class T>
uint64_t bytes_of(const T& values) {
    return std::span(values).size_bytes();
}

template <class Params>
Params make_params() {
    Params params;
    DEFREC_INIT(&params);
    return params;
}

uint32_t round_up(double value, uint32_t multiple) {
    return static_cast<uint32_t>(std::ceil(std::max(value, 1.0) / multiple)) * multiple;
}

// Every kSparseStep-th vertex along rows and columns: neighbouring disparities share their windows,
// so a denser cloud tells lm little more.
constexpr int kSparseStep = 2;
constexpr float kIcpWeight = 2;  // of one of these; measured on the reference sequences
std::vector<defrec_surface_point> sparse_vertices(const TemplateData& data) {
    std::vector<defrec_surface_point> points;
    for (int y = 0; y < data.grid.rows; y += kSparseStep)
        for (int x = 0; x < data.grid.columns; x += kSparseStep) {
            const int32_t vertex = data.grid.vertex[static_cast<size_t>(y * data.grid.columns + x)];
            if (vertex >= 0) points.push_back(data.vertices[static_cast<size_t>(vertex)]);
        }
    return points;
}

constexpr uint32_t kDisparityStep = 16;
constexpr uint32_t kMinDisparities = 48;

}  // namespace

TrackerSettings complete_settings(const defrec_tracker_desc& desc, const Rig& rig) {
    check_ranges(desc);
    TrackerSettings settings = desc;
    settings.device_id = nullptr;  // the caller's
    fill_defaults(settings);
    const float width = static_cast<float>(rig.width());
    if (settings.node_spacing_px == 0) settings.node_spacing_px = width / 24;
    if (settings.vertex_spacing_px == 0) settings.vertex_spacing_px = std::max(4.f, width / 120);
    const uint32_t row = rig.width() * bytes_per_pixel(settings.format);
    if (settings.memory_stride == 0) settings.memory_stride = row;
    if (settings.memory_stride < row)
        fail(DEFREC_ERROR_ARGUMENT, "memory_stride is ", settings.memory_stride,
             " bytes, at least ", row, " (a row of the rig's images) expected");
    return settings;
}

// Everything that depends on the template's counts.
struct Pipeline::TemplateStages {
    std::shared_ptr<const Template> surface;
    DeviceBuffer nodes, edges, points, sparse_points, landmarks, landmark_points, patches, views;
    DeviceBuffer start, coarse, middle, final, matches, weighted, ransac_summary, lm_summary,
        predictions, observations, samples;
    std::unique_ptr<DeviceStage> match, ransac, solve_coarse, align_coarse, solve_middle,
        align_fine, solve_fine, warp;
};

Pipeline::Pipeline(std::shared_ptr<Context> context, std::shared_ptr<const Rig> rig,
                   std::shared_ptr<Device> device, const TrackerSettings& settings)
    : context_(std::move(context)),
      rig_(std::move(rig)),
      device_(std::move(device)),
      settings_(settings),
      width_(rig_->width()),
      height_(rig_->height()),
      queue_(device_) {
    const uint32_t row = width_ * bytes_per_pixel(settings_.format);
    rectify_ = make_rectify(row);
    if (settings_.memory_stride != row) rectify_memory_ = make_rectify(settings_.memory_stride);
    upload_maps();

    stereo_ =
        settings_.disparities != 0
            ? make_stereo(static_cast<uint32_t>(settings_.min_disparity), settings_.disparities)
            : make_stereo(0, widest_search());

    auto orb = make_params<defrec_orb_params>();
    orb.width = width_;
    orb.height = height_;
    orb.capacity = settings_.max_features;
    fill_defaults(orb);
    orb_ = std::make_unique<DeviceStage>(device_, DEFREC_STAGE_ORB, &orb);
    feature_capacity_ = orb.capacity;

    observations_[0] = make_observation();
    if (settings_.frames_in_flight == 1 || settings_.timed) return;
    observations_[1] = make_observation();
    uploads_.emplace(device_);
}

Pipeline::~Pipeline() = default;

Pipeline::Observation Pipeline::make_observation() const {
    const uint64_t pixels = uint64_t{width_} * height_;
    Observation o;
    for (int view = 0; view < 2; ++view) {
        o.raw[view] = DeviceBuffer(device_, pixels * bytes_per_pixel(settings_.format));
        o.gray[view] = DeviceBuffer(device_, pixels);
        o.mask[view] = DeviceBuffer(device_, pixels);
    }
    o.ignore = DeviceBuffer(device_, pixels);
    o.disparity = DeviceBuffer(device_, pixels * sizeof(int16_t));
    o.feature_count = DeviceBuffer(device_, sizeof(uint32_t));
    o.features = DeviceBuffer(device_, uint64_t{feature_capacity_} * sizeof(defrec_feature));
    return o;
}

std::unique_ptr<DeviceStage> Pipeline::make_rectify(uint32_t source_stride) const {
    auto params = make_params<defrec_rectify_params>();
    params.format = settings_.format;
    params.source_width = params.width = width_;
    params.source_height = params.height = height_;
    params.source_stride = source_stride;
    fill_defaults(params);
    return std::make_unique<DeviceStage>(device_, DEFREC_STAGE_RECTIFY, &params);
}

std::unique_ptr<DeviceStage> Pipeline::make_stereo(uint32_t min_disparity,
                                                   uint32_t disparities) const {
    auto params = make_params<defrec_stereo_params>();
    params.width = width_;
    params.height = height_;
    params.min_disparity = static_cast<int32_t>(min_disparity);
    params.disparities = disparities;
    fill_defaults(params);
    return std::make_unique<DeviceStage>(device_, DEFREC_STAGE_STEREO, &params);
}

uint32_t Pipeline::widest_search() const {
    const defrec_camera& camera = rig_->camera();
    const double nearest = camera.fx * camera.baseline_mm / settings_.min_depth_mm;
    return std::clamp(round_up(std::min(nearest, 0.45 * width_), kDisparityStep), kMinDisparities,
                      256u);
}

// A surface seen at these disparities may come nearer or go farther by half; what lies beyond is
// not searched from now on.
void Pipeline::narrow_search(const SurfaceGrid& grid) {
    if (settings_.disparities != 0) return;
    float minimum = 1e9f, maximum = 0;
    for (size_t i = 0; i < grid.vertex.size(); ++i)
        if (grid.vertex[i] >= 0) {
            minimum = std::min(minimum, grid.disparity[i]);
            maximum = std::max(maximum, grid.disparity[i]);
        }
    const uint32_t from = static_cast<uint32_t>(0.55 * minimum) / kDisparityStep * kDisparityStep;
    const uint32_t to = std::min(round_up(1.6 * maximum + 4, kDisparityStep),
                                 std::max(widest_search(), round_up(maximum + 4, kDisparityStep)));
    stereo_ = make_stereo(from, std::max(to - from, kMinDisparities));
}

void Pipeline::upload_maps() {
    for (int view = 0; view < 2; ++view) {
        if (rig_->map(view) == nullptr) continue;
        map_[view] = DeviceBuffer(device_, rig_->map_bytes());
        queue_.write(map_[view], rig_->map(view), rig_->map_bytes());
    }
}

// Writes the time since the last lap into the frame's list of stage times, with `timed` after
// waiting for the stage.
void Pipeline::record_time(const char* stage, FrameOutput& out) {
    if (settings_.timed) queue_.finish();
    const auto now = std::chrono::steady_clock::now();
    if (out.time_count < out.times.size())
        out.times[out.time_count++] = {
            stage, std::chrono::duration<double, std::milli>(now - last_time_).count()};
    last_time_ = now;
}

namespace {
// The image as a buffer: the application's own, or this one with the pixels in it; nullptr where
// there is no image.
const DeviceBuffer* upload(Queue& queue, const FrameImage& image, const DeviceBuffer& buffer) {
    if (image.memory != nullptr) return image.memory.get();
    if (image.pixels == nullptr) return nullptr;
    queue.write_in_place(buffer, image.pixels, buffer.size());
    return &buffer;
}
}  // namespace

void Pipeline::observe(const FrameInput& frame, std::array<uint8_t*, 2> gray, FrameOutput& out) {
    see(*now_, queue_, frame, gray, out);
}

void Pipeline::observe_ahead(const FrameInput& frame, std::array<uint8_t*, 2> gray,
                             FrameOutput& out) {
    const auto followed = last_time_;
    see(*ahead_, *uploads_, frame, gray, out);
    last_time_ = followed;
}

void Pipeline::see(Observation& o, Queue& uploads, const FrameInput& frame,
                   std::array<uint8_t*, 2> gray, FrameOutput& out) {
    out.time_count = 0;
    o.gray_point = 0;
    last_time_ = std::chrono::steady_clock::now();
    const DeviceBuffer* ignored = upload(uploads, frame.ignore, o.ignore);
    const DeviceBuffer* raw[2] = {upload(uploads, frame.views[0], o.raw[0]),
                                  upload(uploads, frame.views[1], o.raw[1])};
    if (&uploads != &queue_) uploads.finish();  // the queue does not wait for another
    record_time("upload", out);
    bool reads_gray = false;
    for (size_t view = 0; view < 2; ++view) {
        const bool in_memory = frame.views[view].memory != nullptr;
        DeviceStage& rectify =
            in_memory && rectify_memory_ != nullptr ? *rectify_memory_ : *rectify_;
        rectify.enqueue(
            queue_, {raw[view], map_[view] ? &map_[view] : nullptr, view == 0 ? ignored : nullptr},
            {&o.gray[view], &o.mask[view]});
        if (in_memory) queue_.read(o.gray[view], gray[view], o.gray[view].size());
        reads_gray |= in_memory;
    }
    if (reads_gray) o.gray_point = queue_.signal();
    record_time("rectify", out);
    stereo_->enqueue(queue_, {&o.gray[0], &o.gray[1], &o.mask[0], &o.mask[1]},
                     {&o.disparity, nullptr});
    record_time("stereo", out);
    orb_->enqueue(queue_, {&o.gray[0], &o.mask[0]}, {&o.feature_count, &o.features});
    queue_.read(o.feature_count, &out.summary->features, sizeof out.summary->features);
    if (settings_.keep_disparity)
        queue_.read(o.disparity, out.disparity.data(), bytes_of(out.disparity));
    record_time("orb", out);
    queue_.signal();
}

void Pipeline::await_gray() {
    if (now_->gray_point != 0) queue_.wait(now_->gray_point);
}

void Pipeline::forget_observation(FrameOutput& out) {
    queue_.finish();
    out.summary->features = 0;
}

void Pipeline::leave_samples(std::span<const defrec_surface_sample> samples,
                             const DeviceBuffer& memory) {
    queue_.write(memory, samples.data(), samples.size_bytes());
    queue_.finish();
}

void Pipeline::drain() noexcept {
    for (Queue* queue : {&queue_, uploads_ ? &*uploads_ : nullptr}) try {
            if (queue != nullptr) queue->finish();
        } catch (const std::exception&) {
            // A queue that fails to wait delivers nothing either.
        }
}

void Pipeline::download_front() {
    const size_t pixels = size_t{width_} * height_;
    host_gray_.resize(pixels);
    host_mask_.resize(pixels);
    host_disparity_.resize(pixels);
    host_features_.resize(feature_capacity_);
    queue_.read(now_->gray[0], host_gray_.data(), bytes_of(host_gray_));
    queue_.read(now_->mask[0], host_mask_.data(), bytes_of(host_mask_));
    queue_.read(now_->disparity, host_disparity_.data(), bytes_of(host_disparity_));
    queue_.read(now_->features, host_features_.data(), bytes_of(host_features_));
    queue_.read(now_->feature_count, &host_feature_count_, sizeof host_feature_count_);
    queue_.finish();
    if (host_feature_count_ > feature_capacity_)
        fail(DEFREC_ERROR_PLUGIN, "the plugin gave ", host_feature_count_,
             " features where at most ", feature_capacity_, " fit");
    host_features_.resize(host_feature_count_);
}

std::optional<TemplateData> Pipeline::capture() {
    download_front();
    CaptureInput input;
    input.width = width_;
    input.height = height_;
    input.camera = rig_->camera();
    input.gray = host_gray_.data();
    input.mask = host_mask_.data();
    input.disparity = host_disparity_.data();
    input.features = host_features_;
    input.vertex_spacing_px = settings_.vertex_spacing_px;
    input.node_spacing_px = settings_.node_spacing_px;
    input.max_patches = settings_.max_patches;
    return capture_template(input);
}

bool Pipeline::views_look_swapped() {
    const uint64_t pixels = uint64_t{width_} * height_;
    host_disparity_.resize(pixels);
    const auto coverage = [&](int first, int second) {
        stereo_->enqueue(
            queue_,
            {&now_->gray[first], &now_->gray[second], &now_->mask[first], &now_->mask[second]},
            {&now_->disparity, nullptr});
        queue_.read(now_->disparity, host_disparity_.data(), bytes_of(host_disparity_));
        queue_.finish();
        const auto known = std::count_if(host_disparity_.begin(), host_disparity_.end(),
                                         [](int16_t d) { return d > 0; });
        return static_cast<double>(known) / static_cast<double>(pixels);
    };
    const double exchanged = coverage(1, 0), given = coverage(0, 1);
    return exchanged > 2 * kMinimumCoverage && exchanged > 3 * given;
}

void Pipeline::upload_template(TemplateStages& t, const TemplateData& data) {
    const auto upload = [&](DeviceBuffer& buffer, const auto& values) {
        buffer = DeviceBuffer(device_, std::max<uint64_t>(bytes_of(values), 16));
        if (!values.empty()) queue_.write(buffer, values.data(), bytes_of(values));
    };
    upload(t.nodes, data.nodes);
    upload(t.edges, data.edges);
    upload(t.points, data.vertices);
    upload(t.sparse_points, sparse_vertices(data));
    upload(t.landmarks, data.landmarks);
    upload(t.landmark_points, data.landmark_points);
    upload(t.patches, data.patches);
    upload(t.views, data.image);
}

void Pipeline::set_template(std::shared_ptr<const Template> surface) {
    const TemplateData& data = surface->data();
    auto stages = std::make_unique<TemplateStages>();
    TemplateStages& t = *stages;
    t.surface = std::move(surface);
    upload_template(t, data);

    const uint32_t nodes = static_cast<uint32_t>(data.nodes.size() / 3),
                   landmarks = static_cast<uint32_t>(data.landmarks.size());
    const uint32_t patches = static_cast<uint32_t>(data.patches.size()),
                   points = static_cast<uint32_t>(data.vertices.size());
    const auto buffer = [&](uint64_t count, uint64_t size) {
        return DeviceBuffer(device_, std::max<uint64_t>(count * size, 16));
    };
    for (DeviceBuffer* motions : {&t.start, &t.coarse, &t.middle, &t.final})
        *motions = buffer(nodes, sizeof(defrec_motion));
    t.matches = buffer(landmarks, sizeof(defrec_match));
    t.weighted = buffer(landmarks, sizeof(defrec_match));
    t.ransac_summary = buffer(1, sizeof(defrec_ransac_summary));
    t.lm_summary = buffer(1, sizeof(defrec_lm_summary));
    t.predictions = buffer(patches, sizeof(defrec_patch_prediction));
    t.observations = buffer(patches, sizeof(defrec_patch_observation));
    t.samples = buffer(points, sizeof(defrec_surface_sample));

    auto match = make_params<defrec_match_params>();
    match.landmarks = landmarks;
    match.features = feature_capacity_;
    match.width = width_;
    match.height = height_;
    match.camera = rig_->camera();
    fill_defaults(match);
    t.match = std::make_unique<DeviceStage>(device_, DEFREC_STAGE_MATCH, &match);
    t.match->prepare(queue_, {&t.landmarks});

    auto ransac = make_params<defrec_ransac_params>();
    ransac.landmarks = landmarks;
    ransac.seed = settings_.seed;
    fill_defaults(ransac);
    t.ransac = std::make_unique<DeviceStage>(device_, DEFREC_STAGE_RANSAC, &ransac);
    t.ransac->prepare(queue_, {&t.landmarks});

    const auto make_align = [&](uint32_t level, uint32_t search) {
        auto align = make_params<defrec_align_params>();
        align.patches = patches;
        align.nodes = nodes;
        align.width = width_;
        align.height = height_;
        align.level = level;
        align.search_radius = search;
        align.camera = rig_->camera();
        fill_defaults(align);
        auto stage = std::make_unique<DeviceStage>(device_, DEFREC_STAGE_ALIGN, &align);
        stage->prepare(queue_, {&t.patches, &t.views});
        return stage;
    };
    t.align_coarse = make_align(1, 8);
    t.align_fine = make_align(0, 4);

    const auto make_lm = [&](uint32_t iterations, bool presolve, float match_weight,
                             float patch_tukey_px, float icp_tukey_mm) {
        auto lm = make_params<defrec_lm_params>();
        lm.nodes = nodes;
        lm.edges = static_cast<uint32_t>(data.edges.size());
        lm.points = static_cast<uint32_t>(t.sparse_points.size() / sizeof(defrec_surface_point));
        lm.icp_weight = kIcpWeight;
        lm.landmarks = landmarks;
        lm.patches = patches;
        lm.width = width_;
        lm.height = height_;
        lm.camera = rig_->camera();
        lm.iterations = iterations;
        lm.presolve = presolve ? 1 : 0;
        lm.node_spacing_mm = static_cast<float>(data.node_spacing_mm);
        lm.match_weight = match_weight;
        lm.patch_tukey_px = patch_tukey_px;
        lm.icp_tukey_mm = icp_tukey_mm;
        lm.cg_iterations = 6;
        lm.arap_weight = settings_.arap_weight;
        lm.match_threshold_mm = 2.f;
        fill_defaults(lm);
        auto stage = std::make_unique<DeviceStage>(device_, DEFREC_STAGE_LM, &lm);
        stage->prepare(queue_,
                       {&t.nodes, &t.edges, &t.sparse_points, &t.landmark_points, &t.patches});
        return stage;
    };
    // The paper's weight while features alone tell where the surface went; once patches do so to a
    // fraction of a pixel, features whose positions are good to about a pixel only hold what has no
    // patch. Patches far from where the surface is so far are what a local deformation looks like,
    // so their kernel is wide at first. Live depth far from it is more and more likely an
    // instrument's, so the kernel of ICP narrows.
    t.solve_coarse = make_lm(settings_.coarse_iterations, true, 10.f, 12.f, 3.f);
    t.solve_middle = make_lm(settings_.coarse_iterations, false, 1.f, 12.f, 1.5f);
    t.solve_fine = make_lm(settings_.fine_iterations, false, 0.5f, 8.f, 1.f);

    auto warp = make_params<defrec_warp_params>();
    warp.nodes = nodes;
    warp.points = points;
    warp.width = width_;
    warp.height = height_;
    warp.camera = rig_->camera();
    fill_defaults(warp);
    t.warp = std::make_unique<DeviceStage>(device_, DEFREC_STAGE_WARP, &warp);
    t.warp->prepare(queue_, {&t.points});
    queue_.finish();
    narrow_search(data.grid);
    follow_ = std::move(stages);
}

void Pipeline::follow(std::span<const defrec_motion> start, const DeviceBuffer* samples,
                      FrameOutput& out) {
    TemplateStages& t = *follow_;
    if (samples == nullptr) samples = &t.samples;
    last_time_ = std::chrono::steady_clock::now();
    queue_.write(t.start, start.data(), start.size_bytes());
    t.match->enqueue(queue_, {&now_->feature_count, &now_->features, &now_->disparity},
                     {&t.matches});
    record_time("match", out);
    t.ransac->enqueue(queue_, {&t.matches}, {&t.weighted, &t.ransac_summary});
    record_time("ransac", out);
    t.solve_coarse->enqueue(queue_, {&t.start, &t.weighted, nullptr, &now_->disparity},
                            {&t.coarse, &t.lm_summary});
    record_time("lm coarse", out);
    t.align_coarse->enqueue(queue_, {&now_->gray[0], &now_->mask[0], &t.coarse, nullptr},
                            {&t.observations, nullptr});
    record_time("align coarse", out);
    t.solve_middle->enqueue(queue_, {&t.coarse, &t.weighted, &t.observations, &now_->disparity},
                            {&t.middle, &t.lm_summary});
    record_time("lm middle", out);
    t.align_fine->enqueue(queue_, {&now_->gray[0], &now_->mask[0], &t.middle, nullptr},
                          {&t.observations, &t.predictions});
    record_time("align fine", out);
    t.solve_fine->enqueue(queue_, {&t.middle, &t.weighted, &t.observations, &now_->disparity},
                          {&t.final, &t.lm_summary});
    record_time("lm fine", out);
    t.warp->enqueue(queue_, {&t.final, &now_->disparity}, {samples});
    record_time("warp", out);
    queue_.read(t.final, out.motions.data(), bytes_of(out.motions));
    queue_.read(*samples, out.samples.data(), bytes_of(out.samples));
    queue_.read(t.weighted, out.matches.data(), bytes_of(out.matches));
    queue_.read(t.observations, out.observations.data(), bytes_of(out.observations));
    queue_.read(t.predictions, out.predictions.data(), bytes_of(out.predictions));
    queue_.read(t.ransac_summary, &out.summary->ransac, sizeof out.summary->ransac);
    followed_ = queue_.signal();
}

void Pipeline::finish(FrameOutput& out) {
    queue_.wait(followed_);
    record_time("download", out);
}

}  // namespace defrec
