// See track_probe.hpp.
#include "sdk/doctor/track_probe.hpp"

#include <algorithm>

#include "sdk/client/library.hpp"
#include "sdk/client/tracker_config.hpp"
#include "sdk/doctor/decisions.hpp"
#include "sdk/io/interrupt.hpp"

namespace defrec::cli {
namespace {

// A pair that takes frames as they are.
StereoCalibration nominal_calibration(int width, int height) {
    StereoCalibration calibration;
    calibration.width = width;
    calibration.height = height;
    for (CameraCalibration* camera : {&calibration.left, &calibration.right}) {
        camera->fx = camera->fy = width;
        camera->cx = 0.5 * (width - 1);
        camera->cy = 0.5 * (height - 1);
    }
    calibration.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    calibration.translation = {-1, 0, 0};
    return calibration;
}

Rig choose_rig(const Context& context, const StereoFrame& frame,
               const StereoCalibration* calibration, std::string& refusal) {
    if (calibration != nullptr) {
        try {
            return make_rig(context, *calibration);
        } catch (const CliError& error) {
            if (error.code() != ExitCode::kCalibration) throw;
            refusal = error.what();
        }
    }
    return make_rig(context, nominal_calibration(frame.left.width, frame.left.height));
}

}  // namespace

void ProbeRecord::add(const defrec_result& result, int width, int height) {
    frames_.push_back({result.state, result.reasons, result.view_lag_frames, depth_share(result),
                       result.rig_matches > 0});
    if (result.disparity == nullptr) return;
    for (int y = 0; y < height; y += decisions::DoctorSample::kDisparityRows) {
        const std::int16_t* row = result.disparity + static_cast<std::size_t>(y) * width;
        for (int x = 0; x < width; ++x) {
            if (row[x] < 0) continue;
            ++disparities_[static_cast<std::size_t>(row[x] / DEFREC_DISPARITY_ONE)];
            ++counted_;
        }
    }
}

double ProbeRecord::disparity_at(std::size_t rank) const {
    std::size_t below = 0;
    for (std::size_t i = 0; i < disparities_.size(); ++i) {
        below += disparities_[i];
        if (below >= std::max<std::size_t>(rank, 1)) return static_cast<double>(i);
    }
    return 0;
}

TrackProbe ProbeRecord::probe(bool has_rig, const defrec_camera& camera) const {
    constexpr std::size_t kAway = 1000;  // one of as many at either end is left out
    TrackProbe probe;
    probe.has_rig = has_rig;
    probe.frames = frames_;
    probe.camera = camera;
    if (counted_ == 0) return probe;
    probe.least_disparity = disparity_at(counted_ / kAway);
    probe.largest_disparity = disparity_at(counted_ - counted_ / kAway) + 1;
    return probe;
}

TrackProbe track_frames(const ProbeOptions& options, const std::vector<StereoFrame>& frames,
                        const StereoCalibration* calibration, std::string& refusal) {
    const Context context = open_context({options.threads, true, {}});
    const Device device = choose_device(context, options.backend, options.device);
    const Rig rig = choose_rig(context, frames.front(), calibration, refusal);
    auto desc = initialised<defrec_tracker_desc>();
    desc.format = format_of_channels(frames.front().left.channels);
    desc.device_id = device.id.c_str();
    if (!options.config.empty()) read_config(options.config, desc);
    desc.body = DEFREC_BODY_OFF;
    desc.keep_disparity = 1;
    defrec_tracker handle = nullptr;
    require(defrec_tracker_create(context.get(), rig.get(), &desc, &handle),
            options.config.empty() ? ExitCode::kInternal : ExitCode::kUsage,
            "creating the tracker");
    const Tracker tracker(handle);
    ProbeRecord record;
    int waiting = 0;  // lit frames without a template
    for (const StereoFrame& frame : frames) {
        throw_if_interrupted();
        const Job job = submit(tracker, frame);
        const defrec_result result = result_of(job, frame.index);
        record.add(result, frame.left.width, frame.left.height);
        const bool is_lit = record.last().is_lit();
        waiting = result.state == DEFREC_INITIALISING ? waiting + (is_lit ? 1 : 0) : 0;
        if (waiting == decisions::DoctorSample::kMostWaiting) break;
    }
    return record.probe(calibration != nullptr && refusal.empty(), rig_info(rig).camera);
}

}  // namespace defrec::cli
