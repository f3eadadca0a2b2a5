// `defrec devices --verify`.
#include "sdk/cli/devices/probe.hpp"

#include <optional>
#include <utility>

#include "sdk/cli/devices/child_program.hpp"
#include "sdk/cli/devices/library_folder.hpp"
#include "sdk/cli/devices/probe_reply.hpp"
#include "sdk/client/library.hpp"
#include "sdk/io/terminal.hpp"
#include "sdk/plugin/search.hpp"

namespace defrec::cli {
namespace {

constexpr int kProbeWidth = 192, kProbeHeight = 128;
constexpr std::uint64_t kProbeLimitNs = 10'000'000'000;

// One frame of noise, shifted by a few pixels between the views: enough to run every stage that a
// frame begins with.
void track_noise(const Context& context, const Device& device) {
    StereoCalibration calibration;
    calibration.width = kProbeWidth;
    calibration.height = kProbeHeight;
    calibration.left = {200, 200, kProbeWidth / 2.0, kProbeHeight / 2.0, {}, "the probe's camera",
                        {}};
    calibration.right = calibration.left;
    calibration.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    calibration.translation = {-5, 0, 0};
    const Rig rig = make_rig(context, calibration);

    constexpr int kShift = 12;
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(kProbeHeight) *
                                     (kProbeWidth + kShift));
    std::uint32_t state = 1;
    for (std::uint8_t& pixel : pixels) {
        state = state * 1664525u + 1013904223u;
        pixel = static_cast<std::uint8_t>(40 + (state >> 24) % 160);
    }
    StereoFrame frame;
    frame.left = {pixels.data(), kProbeWidth, kProbeHeight, 1, kProbeWidth + kShift};
    frame.right = frame.left;
    frame.right.pixels += kShift;

    auto desc = initialised<defrec_tracker_desc>();
    desc.device_id = device.id.c_str();
    desc.format = DEFREC_FORMAT_GRAY8;
    defrec_tracker handle = nullptr;
    require(defrec_tracker_create(context.get(), rig.get(), &desc, &handle), ExitCode::kDevice,
            device.id);
    const Tracker tracker(handle);
    const Job job = submit(tracker, frame);
    const defrec_status status = defrec_job_wait(job.get(), kProbeLimitNs);
    require(status, ExitCode::kDevice, device.id);
    if (status == DEFREC_TIMEOUT)
        throw CliError(ExitCode::kDevice, device.id + ": one small frame took over 10 s.");
}

}  // namespace

ProbeResult probe_in_child(const std::string& program, const std::string& manifest,
                           std::chrono::milliseconds limit) {
    ProbeResult result;
    result.manifest = manifest;
    const ChildOutput output = run_child({program, "devices", "--probe", manifest}, limit);
    if (output.timed_out) {
        result.message = "it did not answer within " + std::to_string(limit.count() / 1000) +
                         " s and was ended.";
    } else if (!output.crash.empty()) {
        result.message = "it crashed the process that opened it (" + output.crash + ").";
    } else {
        std::optional<ProbeReply> reply = read_probe_reply(output.text);
        if (!reply) {
            result.message = "it ended the process that opened it, with exit code " +
                             std::to_string(output.exit_code) + ".";
            return result;
        }
        result.is_good = reply->is_good;
        result.message = std::move(reply->message);
        result.devices = std::move(reply->devices);
    }
    return result;
}

std::vector<ProbeResult> probe_all(const std::string& program, std::chrono::milliseconds limit) {
    // Who may write to a folder is looked at where a plugin in it is opened.
    const auto refuses_none = [](const std::string&) { return std::string(); };
    std::vector<ProbeResult> results;
    for (const FoundManifest& found : find_manifests({{}, true, library_folder()}, refuses_none))
        results.push_back(found.reason.empty() ? probe_in_child(program, found.path, limit)
                                               : ProbeResult{found.path, false, found.reason, {}});
    return results;
}

int run_probe(const std::string& manifest) {
    ProbeReply reply;
    reply.is_good = true;
    try {
        const Context context = open_context({1, true, {manifest}});
        for (const Plugin& plugin : list_plugins(context)) {
            if (plugin.is_loaded && plugin.reason.empty()) continue;
            reply.is_good = false;
            reply.message = plugin.reason;
        }
        for (const Device& device : list_devices(context)) {
            reply.devices.push_back(device.id);
            if (device.has_every_stage()) track_noise(context, device);
        }
        if (reply.is_good)
            reply.message = reply.devices.empty() ? "it loads and has no device here."
                                                  : "it loads and tracks a frame.";
    } catch (const CliError& error) {
        reply.is_good = false;
        reply.message = error.what();
    }
    print(write_probe_reply(reply) + "\n");
    return static_cast<int>(ExitCode::kOk);
}

}  // namespace defrec::cli
