// A frame on its way through a pipeline. Each step takes the object that the step before gave:
// observe makes an ObservedFrame, which capture reads; follow makes a RegisteredFrame of it, which
// finish ends or take_back undoes. observe_and_follow makes one at once.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <utility>

#include "sdk/tracking/frame/frame_input.hpp"
#include "sdk/tracking/frame/quality_level.hpp"
#include "sdk/tracking/frame/stage_timer.hpp"

namespace defrec {

class Pipeline;

// Where a frame comes from and where its results go. All of it stays as it is until the frame's
// work is over.
struct FrameTask {
    const FrameInput& input;  // its host pixels in tight rows
    // Where the rectified pixels of a view in memory are read back to.
    std::array<uint8_t*, 2> gray;
    FrameOutput& output;
};

// How a template is followed into a frame.
struct RegistrationPlan {
    bool uses_depth = true;  // false: by the left image alone
    bool whole_map = true;   // false: what lies far outside of the image need not be solved finely
    bool searches_widely = false;  // patches are searched farther away, in coarser images
    QualityLevel quality_level = QualityLevel::kFull;
};

// What one frame's images become on the device. raw and ignore are empty where it reads the frame's
// own memory.
struct Observation {
    DeviceBuffer raw[2], gray[2], mask[2], ignore, disparity, feature_count, features;
    uint32_t searched_end = 0;  // px, of the disparities that stage stereo searched
    bool is_taken = false;      // by a frame
    bool has_work = false;      // in a queue
};

// The images are on the device, or on their way there. Where it goes no further, the end of its
// work is waited for: nothing is written into its output later.
class ObservedFrame {
  private:
    friend class Pipeline;
    struct End {
        Pipeline* pipeline;
        void operator()(Observation* observation) const noexcept;
    };
    ObservedFrame(std::unique_ptr<Observation, End> observation, const FrameTask& task,
                  Queue* timed)
        : observation_(std::move(observation)), task_(task), timer_(task.output, timed) {}

    std::unique_ptr<Observation, End> observation_;
    FrameTask task_;
    StageTimer timer_;
    uint64_t gray_point_ = 0;  // in the queue, behind gray pixels that are read back; 0: none are
};

// The template is followed into the frame, or the device is at it.
class RegisteredFrame {
  private:
    friend class Pipeline;
    RegisteredFrame(ObservedFrame frame, uint64_t end_point, uint32_t times_before)
        : frame_(std::move(frame)), end_point_(end_point), times_before_(times_before) {}

    ObservedFrame frame_;
    uint64_t end_point_;     // in the queue
    uint32_t times_before_;  // it was followed, of its output
};

}  // namespace defrec
