// What the doctor finds in the first frames of a run and in its calibration, while the run goes on:
// of the run's own results, and on a thread of low priority, so that tracking does not wait.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "include/defrec_c.h"
#include "sdk/base/os/background_thread.hpp"
#include "sdk/doctor/evidence.hpp"
#include "sdk/doctor/track_probe.hpp"
#include "sdk/input/frame_source.hpp"
#include "sdk/io/calibration.hpp"
#include "sdk/session/compression_watch.hpp"

namespace defrec::cli {

class InputChecks {
  public:
    // calibration: as the files have it. camera: of the rectified views. show: is given the
    // diagnosis, as `defrec doctor --json` prints it, once, on the checks' thread.
    InputChecks(StereoCalibration calibration, const defrec_camera& camera,
                std::function<void(std::string)> show);
    InputChecks(const InputChecks&) = delete;
    InputChecks& operator=(const InputChecks&) = delete;
    // Waits for the one frame, at most, whose views are being matched; nothing is shown then.
    ~InputChecks() = default;

    // The frames in order, each with its result, of a tracker that keeps disparities; compression:
    // has been given the frame before. Frames behind those that are looked at cost nothing.
    void add(const StereoFrame& frame, const defrec_result& result,
             const CompressionWatch& compression);

  private:
    // On the thread: what fails is shown in place of findings.
    void attempt(const std::function<void()>& work);
    void conclude();

    const StereoCalibration calibration_;
    const defrec_camera camera_;
    const std::function<void(std::string)> show_;
    std::size_t count_ = 0, next_ = 0;  // frames to look at, from the first one on; the next one
    FramesToMatch to_match_{0};         // of them
    ProbeRecord record_;
    std::vector<BlankFrame> blank_frames_;
    RepeatMeter repeats_;
    std::vector<RepeatedFrame> repeated_frames_;
    Evidence evidence_;        // the thread's, once it has begun
    std::string failure_;      // likewise; empty: none
    BackgroundThread thread_;  // ends first
};

}  // namespace defrec::cli
