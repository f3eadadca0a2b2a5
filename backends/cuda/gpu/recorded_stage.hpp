// A stage with what it recorded for each set of buffers. plugins/cuda puts it behind the plugin
// ABI.
#pragma once
#include <memory>
#include <mutex>

#include "backends/cuda/gpu/queue.hpp"
#include "backends/cuda/stage.hpp"
#include "backends/shared/recorded_runs.hpp"

namespace defrec::cuda {

// nullptr: an optional buffer that was not given.
using Buffers = std::span<const Buffer* const>;

// Destroy it only when the device has settled. threads: any.
class RecordedStage {
  public:
    RecordedStage(Gpu& gpu, std::unique_ptr<Stage> stage);
    // Waits for the queue.
    void prepare(Queue& queue, Buffers in);
    void enqueue(Queue& queue, Buffers in, Buffers out);

  private:
    Gpu& gpu_;
    std::unique_ptr<Stage> stage_;
    uint64_t serial_;
    std::mutex mutex_;
    RecordedRuns<std::shared_ptr<const StageRun>, Buffer> runs_;
};

}  // namespace defrec::cuda
