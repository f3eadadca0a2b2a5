// See tracking.hpp.
#include "conformance/cases/sequence/tracking.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <mutex>
#include <span>

#include "conformance/worker/failure.hpp"
#include "sdk/base/util/fnv1a.hpp"

namespace defrec::conformance {
namespace {

constexpr int64_t kFrameNs = 40'000'000;

template <class T>
uint64_t digest(uint64_t hash, const T* items, uint64_t count) {
    return fnv1a(hash, items, count * sizeof(T));
}

uint64_t digest_of(const defrec_template_info& info) {
    uint64_t hash = digest(kFnvBasis, info.vertices, info.vertex_count);
    hash = digest(hash, info.triangles, 3 * info.triangle_count);
    hash = digest(hash, info.nodes, 3 * info.node_count);
    hash = digest(hash, info.edges, info.edge_count);
    hash = digest(hash, info.landmarks, info.landmark_count);
    hash = digest(hash, info.patches, info.patch_count);
    return digest(hash, info.image, uint64_t{info.width} * info.height);
}

// The sequence's points on the template's surface, xyz in its frame.
std::vector<double> lift(defrec_rig rig, defrec_template surface, const RenderedSequence& sequence,
                         Track& track) {
    const size_t count = sequence.points.size() / 2;
    std::vector<double> rectified(sequence.points.size()), xyz(3 * count);
    track.on_surface.resize(count);
    check_api("defrec_rig_rectify_pixels",
              defrec_rig_rectify_pixels(rig, sequence.points.data(), count, rectified.data()));
    check_api("defrec_template_lift", defrec_template_lift(surface, rectified.data(), count,
                                                           xyz.data(), track.on_surface.data()));
    return xyz;
}

}  // namespace

void check_api(const char* call, defrec_status status) {
    if (status < 0)
        fail_case(call, " answered ", defrec_status_name(status), ": ", defrec_last_error());
}

ContextHandle open_context(const std::string& manifest, defrec_context_desc desc) {
    const char* const path = manifest.c_str();
    desc.flags = DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS;
    desc.plugin_paths = &path;
    desc.plugin_path_count = 1;
    ContextHandle context;
    check_api("defrec_context_create", defrec_context_create(&desc, context.out()));
    defrec_plugin_info info;
    DEFREC_INIT(&info);
    require(defrec_plugin_count(context.get()) == 1, "the library found ",
            defrec_plugin_count(context.get()), " plugins, one was given");
    check_api("defrec_plugin_get", defrec_plugin_get(context.get(), 0, &info));
    require(info.verdict == DEFREC_OK, "the library refused the plugin: ", info.reason);
    return context;
}

ContextHandle open_context(const std::string& manifest) {
    defrec_context_desc desc;
    DEFREC_INIT(&desc);
    desc.threads = 2;
    return open_context(manifest, desc);
}

TrackerHandle open_tracker(defrec_context context, defrec_rig rig, const std::string& device_id,
                           bool grows) {
    defrec_tracker_desc desc;
    DEFREC_INIT(&desc);
    desc.device_id = device_id.c_str();
    desc.seed = 1;
    desc.grow = grows ? 1 : 0;
    TrackerHandle tracker;
    check_api("defrec_tracker_create", defrec_tracker_create(context, rig, &desc, tracker.out()));
    return tracker;
}

defrec_image image_of(const RenderedSequence& sequence, const std::vector<uint8_t>& pixels) {
    defrec_image image;
    DEFREC_INIT(&image);
    image.format = DEFREC_FORMAT_BGR8;
    image.width = sequence.request.width;
    image.height = sequence.request.height;
    image.pixels = pixels.data();
    return image;
}

JobHandle submit(defrec_tracker tracker, const RenderedSequence& sequence, size_t frame) {
    const defrec_image left = image_of(sequence, sequence.frames[frame].left),
                       right = image_of(sequence, sequence.frames[frame].right);
    defrec_frame desc;
    DEFREC_INIT(&desc);
    desc.timestamp_ns = kFrameNs * static_cast<int64_t>(frame + 1);
    desc.left = &left;
    desc.right = &right;
    JobHandle job;
    check_api("defrec_tracker_submit", defrec_tracker_submit(tracker, &desc, job.out()));
    return job;
}

TrackedFrame result_of(defrec_job job, const std::vector<double>& points) {
    defrec_result result;
    DEFREC_INIT(&result);
    check_api("defrec_job_result", defrec_job_result(job, &result));
    TrackedFrame frame;
    frame.state = result.state;
    frame.reasons = result.reasons;
    frame.epoch = result.epoch;
    frame.age = result.age;
    frame.template_epoch = result.template_epoch;
    if (result.vertex_count == 0) return frame;
    frame.vertices.assign(result.vertices, result.vertices + 3 * result.vertex_count);
    frame.vertex_status.assign(result.vertex_status, result.vertex_status + result.vertex_count);
    frame.expected_error.assign(result.expected_error_mm,
                                result.expected_error_mm + result.vertex_count);
    frame.points.resize(points.size());
    frame.point_status.resize(points.size() / 3);
    check_api("defrec_job_warp_points",
              defrec_job_warp_points(job, points.data(), points.size() / 3, frame.points.data(),
                                     frame.point_status.data(), nullptr));
    return frame;
}

Track track(const TrackingDevice& device, const RenderedSequence& sequence) {
    const ContextHandle context = open_context(device.manifest);
    return track_in(context.get(), device.device_id, sequence);
}

Track track_in(defrec_context context, const std::string& device_id,
               const RenderedSequence& sequence) {
    RigHandle rig;
    check_api("defrec_rig_create", defrec_rig_create(context, &sequence.rig, rig.out()));
    defrec_rig_info rig_info;
    DEFREC_INIT(&rig_info);
    check_api("defrec_rig_get", defrec_rig_get(rig.get(), &rig_info));
    Track track;
    std::copy(std::begin(rig_info.rotation), std::end(rig_info.rotation),
              track.rectification.begin());
    track.camera = rig_info.camera;
    const TrackerHandle tracker =
        open_tracker(context, rig.get(), device_id, sequence.request.grows);
    std::vector<double> points;
    for (size_t i = 0; i < sequence.frames.size(); ++i) {
        const JobHandle job = submit(tracker.get(), sequence, i);
        check_api("defrec_job_wait", defrec_job_wait(job.get(), UINT64_MAX));
        if (i == 0) {
            TemplateHandle surface;
            check_api("defrec_tracker_get_template",
                      defrec_tracker_get_template(tracker.get(), surface.out()));
            defrec_template_info info;
            DEFREC_INIT(&info);
            check_api("defrec_template_get", defrec_template_get(surface.get(), &info));
            track.template_digest = digest_of(info);
            points = lift(rig.get(), surface.get(), sequence, track);
        }
        track.frames.push_back(result_of(job.get(), points));
    }
    return track;
}

const Track& kept_track(const TrackingDevice& device, const RenderedSequence& sequence) {
    static std::mutex mutex;
    static std::map<std::pair<TrackingDevice, SequenceRequest>, std::unique_ptr<const Track>> known;
    const std::lock_guard lock(mutex);
    auto& kept = known[{device, sequence.request}];
    if (kept == nullptr) kept = std::make_unique<const Track>(track(device, sequence));
    return *kept;
}

}  // namespace defrec::conformance
