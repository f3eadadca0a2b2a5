// Two files with poses, a zero byte between them, and a hand-eye calibration of what they hold.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <span>

#include "include/defrec_c.h"
#include "sdk/fuzz/memory_file.hpp"
#include "sdk/hand_eye/program/pose_file.hpp"
#include "sdk/io/exit_code.hpp"

constexpr double kMaxResidual = 3;  // mm, the default

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace defrec;
    const std::span<const unsigned char> bytes(data, size);
    const auto zero = std::find(bytes.begin(), bytes.end(), 0);
    const fuzz::MemoryFile camera({bytes.begin(), zero});
    const fuzz::MemoryFile tracker({zero == bytes.end() ? zero : zero + 1, bytes.end()});
    defrec_hand_eye hand_eye = nullptr;
    try {
        const cli::PoseFile seen = cli::read_timed_poses(camera.path(), {}, true),
                            tracked = cli::read_timed_poses(tracker.path(), {}, false);
        defrec_hand_eye_desc desc;
        DEFREC_INIT(&desc);
        desc.flags = DEFREC_HAND_EYE_PAIRED;
        desc.camera_poses = seen.poses.data();
        desc.camera_count = seen.count();
        desc.tracker_poses = tracked.poses.data();
        desc.tracker_count = tracked.count();
        if (defrec_hand_eye_create(&desc, &hand_eye) != DEFREC_OK) return 0;
    } catch (const cli::CliError&) {
        return 0;
    }
    defrec_hand_eye_info info;
    DEFREC_INIT(&info);
    const auto is_finite = [](double value) { return std::isfinite(value); };
    if (defrec_hand_eye_get(hand_eye, &info) != DEFREC_OK ||
        (info.verdict == DEFREC_VERDICT_ACCEPTED &&
         !(std::all_of(info.marker_from_camera, std::end(info.marker_from_camera), is_finite) &&
           std::all_of(info.covariance, std::end(info.covariance), is_finite) &&
           info.rms_mm <= kMaxResidual)))
        std::abort();
    defrec_hand_eye_destroy(hand_eye);
    return 0;
}
