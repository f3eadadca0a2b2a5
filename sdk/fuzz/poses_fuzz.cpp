// Two files with poses, a zero byte between them, and a hand-eye calibration of what they hold.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <span>

#include "sdk/base/util/error.hpp"
#include "sdk/fuzz/memory_file.hpp"
#include "sdk/hand_eye/hand_eye.hpp"
#include "sdk/hand_eye/program/pose_file.hpp"
#include "sdk/io/exit_code.hpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace defrec;
    const std::span<const unsigned char> bytes(data, size);
    const auto zero = std::find(bytes.begin(), bytes.end(), 0);
    const fuzz::MemoryFile camera({bytes.begin(), zero});
    const fuzz::MemoryFile tracker({zero == bytes.end() ? zero : zero + 1, bytes.end()});
    try {
        HandEyeOptions options;
        options.is_paired = true;
        const HandEyeCalibration found =
            calibrate_hand_eye(cli::read_timed_poses(camera.path(), {}, true).poses,
                               cli::read_timed_poses(tracker.path(), {}, false).poses, options);
        if (found.verdict == HandEyeVerdict::kSolved &&
            !(found.transforms.marker_from_camera.matrix().allFinite() &&
              found.covariance.allFinite() && found.quality.rms_mm <= options.max_residual_mm))
            std::abort();
    } catch (const cli::CliError&) {
    } catch (const Error&) {
    }
    return 0;
}
