// A device, a rig and frames of the scene in test_scene.hpp, for tests of the tracker's parts.
#pragma once
#include <doctest/doctest.h>

#include <algorithm>
#include <memory>
#include <string>

#include "sdk/device/context.hpp"
#include "sdk/rig/rig.hpp"
#include "sdk/testing/test_scene.hpp"
#include "sdk/tracking/frame/frame.hpp"
#include "sdk/tracking/frame/tracker_settings.hpp"
#include "sdk/tracking/job.hpp"

namespace defrec::test {

// The manifest of the plugin "cpu", "reference", or "asynchronous": a device whose queues have
// threads of their own.
inline std::string manifest_of(const std::string& plugin) {
    const std::string folder = plugin == "asynchronous" ? "/test_plugins/asynchronous" : "/lib";
    return DEFREC_BUILD_DIR + folder + "/defrec_plugin_" + plugin + ".json";
}

struct TestDevice {
    explicit TestDevice(const std::string& plugin) {
        const std::string manifest = manifest_of(plugin);
        const char* places[] = {manifest.c_str()};
        defrec_context_desc desc{};
        desc.flags = DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS;
        desc.plugin_paths = places;
        desc.plugin_path_count = 1;
        desc.threads = 2;
        context = Context::create(desc);
        device = choice().open();
        rig = std::make_shared<const Rig>(context->allocator(), scene_rig());
    }

    DeviceChoice choice() const {
        return context->choose_device(nullptr, (1u << DEFREC_STAGE_COUNT_V1) - 1).devices.front();
    }
    // The monitor of a tracker on the device.
    std::shared_ptr<JobMonitor> monitor() const {
        return std::make_shared<JobMonitor>(
            choice(), std::make_shared<DeviceWatch>(choice().services()->plugin_deadline()));
    }

    TrackerSettings settings(uint32_t frames_in_flight, bool timed = false) const {
        defrec_tracker_desc desc{};
        desc.format = DEFREC_FORMAT_GRAY8;
        desc.frames_in_flight = frames_in_flight;
        desc.timed = timed ? 1 : 0;
        return complete_settings(desc, *rig);
    }

    std::shared_ptr<Context> context;
    std::shared_ptr<Device> device;
    std::shared_ptr<const Rig> rig;
};

// A frame and the memory of its results. Outlives the pipeline's work on it.
struct TestFrame {
    TestFrame(const TestDevice& on, const Pair& pair)
        : pixels{HostMemory(on.device, pair.left.size()), HostMemory(on.device, pair.right.size())},
          memory(on.device, 0) {
        std::copy(pair.left.begin(), pair.left.end(), pixels[0].as<uint8_t>().begin());
        std::copy(pair.right.begin(), pair.right.end(), pixels[1].as<uint8_t>().begin());
        for (size_t view = 0; view < 2; ++view) {
            input.views[view].pixels = pixels[view].as<uint8_t>().data();
            input.views[view].stride = kWidth;
        }
    }
    FrameTask task() {
        return {
            input, {pixels[0].as<uint8_t>().data(), pixels[1].as<uint8_t>().data()}, memory.output};
    }
    FrameOutput& output() { return memory.output; }

    HostMemory pixels[2];
    FrameInput input;
    FrameMemory memory;
};

}  // namespace defrec::test
