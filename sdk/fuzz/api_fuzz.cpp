// Calls of the C API in any order, with any numbers and with handles that may be missing.
#include <algorithm>
#include <deque>
#include <filesystem>
#include <functional>

#include "sdk/fuzz/input.hpp"
#include "sdk/fuzz/session.hpp"

using namespace defrec::fuzz;

namespace {

// Everything that one input made; ended in the order in which it must be.
struct World {
    defrec_context context;
    Input& input;
    std::vector<defrec_rig> rigs;
    std::vector<defrec_tracker> trackers;
    std::vector<defrec_job> jobs;
    std::vector<defrec_template> templates;
    std::array<Pair, 2> pairs{Pair(0), Pair(1)};

    ~World() {
        for (defrec_template surface : templates) defrec_template_release(surface);
        for (defrec_job job : jobs) defrec_job_release(job);
        for (defrec_tracker tracker : trackers) defrec_tracker_destroy(tracker);
        for (defrec_rig rig : rigs) defrec_rig_destroy(rig);
    }

    // One of them, or none.
    template <class T>
    T any(const std::vector<T>& handles) {
        const auto index = input.number<size_t>(0, handles.size());
        return index < handles.size() ? handles[index] : nullptr;
    }
    template <class T>
    T take(std::vector<T>& handles) {
        const T handle = any(handles);
        handles.erase(std::remove(handles.begin(), handles.end(), handle), handles.end());
        return handle;
    }
    double number() {
        constexpr double kAny[] = {0, 1, -1, 48, 1e300, -1e300, NAN, INFINITY};
        return input.flag() ? input.one_of(kAny) : input.real(-200, 200);
    }
    uint32_t count() {
        return input.flag() ? input.number<uint32_t>(0, 100) : input.number<uint32_t>();
    }
};

void make_rig(World& world) {
    if (world.rigs.size() >= 3) return;
    defrec_rig_desc desc = small_rig();
    if (world.input.flag()) desc.left.fx = world.number();
    if (world.input.flag()) desc.translation[0] = world.number();
    if (world.input.flag()) {
        desc.left.distortion_count = world.input.number<uint32_t>(0, 20);
        desc.left.distortion[0] = world.number() * 1e-3;
    }
    if (world.input.flag()) desc.rotation[1] = world.number() * 1e-2;
    defrec_rig rig = nullptr;
    if (defrec_rig_create(world.context, &desc, &rig) == DEFREC_OK) world.rigs.push_back(rig);
}

void make_tracker(World& world) {
    if (world.trackers.size() >= 2) return;
    defrec_tracker_desc desc;
    DEFREC_INIT(&desc);
    desc.device_id = "cpu";
    desc.format = world.input.number<uint32_t>(0, 5);
    desc.frames_in_flight = world.input.number<uint32_t>(0, 4);
    desc.grow = world.input.number<uint32_t>(0, 2);
    desc.self_calibration = world.input.number<uint32_t>(0, 3);
    if (world.input.flag()) desc.arap_weight = static_cast<float>(world.number());
    if (world.input.flag()) desc.vertex_spacing_px = static_cast<float>(world.number());
    defrec_tracker tracker = nullptr;
    if (defrec_tracker_create(world.context, world.any(world.rigs), &desc, &tracker) == DEFREC_OK)
        world.trackers.push_back(tracker);
}

void submit(World& world) {
    defrec_image images[2];
    for (size_t view = 0; view < 2; ++view) {
        const Pair& pair = world.pairs[world.input.number<size_t>(0, 1)];
        DEFREC_INIT(&images[view]);
        images[view].format = DEFREC_FORMAT_GRAY8;
        images[view].width = kWidth;
        images[view].height = kHeight;
        images[view].pixels = pair.views[view].data();
    }
    defrec_frame frame;
    DEFREC_INIT(&frame);
    frame.timestamp_ns = world.input.number<int64_t>();
    frame.flags = world.input.number<uint32_t>(0, 3);
    frame.left = &images[0];
    frame.right = world.input.flag() ? &images[1] : &images[0];
    std::vector<float> px;
    defrec_disparity disparity;
    DEFREC_INIT(&disparity);
    if (world.input.flag()) {
        px.assign(size_t{kWidth} * kHeight, static_cast<float>(world.number()));
        disparity.width = kWidth;
        disparity.height = kHeight;
        disparity.disparity = px.data();
        disparity.sigma_px = static_cast<float>(world.number());
        if (world.input.flag()) disparity.sigma = px.data();
        frame.disparity = &disparity;
    }
    defrec_job job = nullptr;
    if (defrec_tracker_submit(world.any(world.trackers), &frame, &job) == DEFREC_OK)
        world.jobs.push_back(job);
}

void look_at(World& world) {
    const defrec_job job = world.any(world.jobs);
    constexpr uint64_t kTimes[] = {0, 1000000, UINT64_MAX};
    static_cast<void>(defrec_job_wait(job, world.input.one_of(kTimes)));
    defrec_result result;
    DEFREC_INIT(&result);
    static_cast<void>(defrec_job_result(job, &result));
    const double uv[4] = {world.number(), world.number(), 40, 30};
    double xyz[6], moved[6], covariance[12];
    uint8_t found[2], status[2], evidence[2];
    const size_t points = world.input.number<size_t>(0, 2);
    if (defrec_job_lift_points(job, uv, points, xyz, found) != DEFREC_OK || points < 2) return;
    if (world.input.flag()) xyz[0] = world.number();
    static_cast<void>(defrec_job_warp_points(job, xyz, points, moved, status, nullptr));
    static_cast<void>(defrec_job_point_covariances(job, xyz, points, covariance, evidence));
}

void get_template(World& world) {
    defrec_template surface = nullptr;
    const defrec_status status =
        world.input.flag() ? defrec_job_get_template(world.any(world.jobs), &surface)
                           : defrec_tracker_get_template(world.any(world.trackers), &surface);
    if (status == DEFREC_OK && surface != nullptr) world.templates.push_back(surface);
}

constexpr void (*kCalls[])(World&) = {
    make_rig,
    make_tracker,
    submit,
    submit,
    look_at,
    get_template,
    [](World& world) {
        static_cast<void>(
            defrec_tracker_set_template(world.any(world.trackers), world.any(world.templates)));
    },
    [](World& world) { defrec_job_release(world.take(world.jobs)); },
    [](World& world) { defrec_template_release(world.take(world.templates)); },
    [](World& world) { defrec_tracker_destroy(world.take(world.trackers)); },
    [](World& world) { defrec_rig_destroy(world.take(world.rigs)); },
    [](World& world) {
        defrec_device_info info;
        DEFREC_INIT(&info);
        static_cast<void>(defrec_device_get(world.context, world.count(), &info));
    },
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static defrec_context const context = make_context();
    Input input(data, size);
    World world{context, input, {}, {}, {}, {}};
    make_rig(world);
    make_tracker(world);
    for (int i = 0; i < 40 && !input.is_empty(); ++i) input.one_of(kCalls)(world);
    return 0;
}
