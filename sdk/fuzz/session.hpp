// A tracker of a small scene on backend cpu, through the C API, for the whole run.
#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "include/defrec_c.h"

namespace defrec::fuzz {

inline constexpr uint32_t kWidth = 96, kHeight = 72;

inline void expect_ok(defrec_status status) {
    if (status != DEFREC_OK) std::abort();
}

// Plugins of this build alone.
inline defrec_context make_context() {
    static const std::string folder = DEFREC_BUILD_DIR "/lib";
    static const char* const places[] = {folder.c_str()};
    defrec_context_desc desc;
    DEFREC_INIT(&desc);
    desc.flags = DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS;
    desc.plugin_paths = places;
    desc.plugin_path_count = 1;
    desc.threads = 1;
    defrec_context context = nullptr;
    expect_ok(defrec_context_create(&desc, &context));
    return context;
}

inline defrec_rig_desc small_rig() {
    defrec_rig_desc desc;
    DEFREC_INIT(&desc);
    desc.width = kWidth;
    desc.height = kHeight;
    desc.left = {100, 100, kWidth / 2.0, kHeight / 2.0, {}, 0, 0};
    desc.right = desc.left;
    desc.rotation[0] = desc.rotation[4] = desc.rotation[8] = 1;
    desc.translation[0] = -5;
    return desc;
}

// A pair that shows a textured plane at 5 / 6 of 100 mm, moved by dx px.
struct Pair {
    std::array<std::vector<uint8_t>, 2> views;
    explicit Pair(double dx) {
        for (size_t view = 0; view < 2; ++view)
            for (uint32_t y = 0; y < kHeight; ++y)
                for (uint32_t x = 0; x < kWidth; ++x) {
                    const double u = x - dx + (view == 1 ? 6 : 0), v = y;
                    const double gray = 128 + 40 * std::sin(0.9 * u + 0.3 * v) * std::cos(0.7 * v) +
                                        40 * std::sin(0.23 * u * v / 20 + 0.5 * u);
                    views[view].push_back(static_cast<uint8_t>(gray));
                }
    }
};

class Session {
  public:
    explicit Session(defrec_context context) {
        const defrec_rig_desc rig_desc = small_rig();
        expect_ok(defrec_rig_create(context, &rig_desc, &rig));
        defrec_tracker_desc desc;
        DEFREC_INIT(&desc);
        desc.device_id = "cpu";
        desc.format = DEFREC_FORMAT_GRAY8;
        expect_ok(defrec_tracker_create(context, rig, &desc, &tracker));
    }
    ~Session() {
        defrec_tracker_destroy(tracker);
        defrec_rig_destroy(rig);
    }
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    // A frame that is waited for.
    defrec_job track(const Pair& pair) {
        defrec_image images[2];
        for (size_t view = 0; view < 2; ++view) {
            DEFREC_INIT(&images[view]);
            images[view].format = DEFREC_FORMAT_GRAY8;
            images[view].width = kWidth;
            images[view].height = kHeight;
            images[view].pixels = pair.views[view].data();
        }
        defrec_frame frame;
        DEFREC_INIT(&frame);
        frame.timestamp_ns = time_ns_ += 33000000;
        frame.left = &images[0];
        frame.right = &images[1];
        defrec_job job = nullptr;
        expect_ok(defrec_tracker_submit(tracker, &frame, &job));
        return job;
    }

    defrec_rig rig = nullptr;
    defrec_tracker tracker = nullptr;

  private:
    int64_t time_ns_ = 0;
};

}  // namespace defrec::fuzz
