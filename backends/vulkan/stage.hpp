// What a stage of the Vulkan backend looks like from outside. plugins/vulkan puts it behind the
// plugin ABI.
#pragma once
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "backends/shared/recorded_runs.hpp"
#include "backends/shared/stage.hpp"
#include "backends/vulkan/queue.hpp"
#include "backends/vulkan/recorder.hpp"

namespace defrec::vulkan {

// nullptr: an optional buffer that was not given.
using Buffers = std::span<const Buffer* const>;

class Stage {
  public:
    virtual ~Stage() = default;
    // The inputs that stay the same from run to run, in host memory. May allocate, upload and wait;
    // no work of the stage is under way.
    virtual void prepare(std::span<const InBuffer>) {
        throw StageError(DEFREC_ERROR_ARGUMENT, "this stage has nothing to prepare");
    }
    // Checks the buffers, throws StageError, and records everything that one run does. Called once
    // for each set of buffers (again after prepare); what it records may run many times.
    virtual void record(Recorder& recorder, Buffers in, Buffers out) = 0;
};

// A stage with what it recorded for each set of buffers. Destroy it only when the device has
// settled.
class RecordedStage {
  public:
    RecordedStage(Device& device, std::unique_ptr<Stage> stage)
        : device_(device), stage_(std::move(stage)) {}
    // Waits for the queue.
    void prepare(Queue& queue, Buffers in);
    void enqueue(Queue& queue, Buffers in, Buffers out);

  private:
    Device& device_;
    std::unique_ptr<Stage> stage_;
    std::mutex mutex_;
    RecordedRuns<std::unique_ptr<Recording>, Buffer> runs_;
};

// Throws StageError(DEFREC_ERROR_UNSUPPORTED) where a stage is asked for more of something than it
// can do on this device.
void check_size(const char* stage, const char* what, uint64_t size, uint64_t maximum);

// The buffers as the checks of backends/stages take them: sizes, and which are given. Their data
// must not be looked at.
std::vector<InBuffer> sizes_of_inputs(Buffers in);
std::vector<OutBuffer> sizes_of_outputs(Buffers out);

}  // namespace defrec::vulkan
