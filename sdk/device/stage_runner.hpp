// One stage on its own, on host memory: buffers of the device that follow the caller's, up, run,
// down.
#pragma once
#include <algorithm>
#include <memory>
#include <vector>

#include "sdk/device/device.hpp"
#include "sdk/device/stage_params.hpp"

namespace defrec {

// One thread at a time.
class StageRunner {
  public:
    StageRunner(std::shared_ptr<const Device> device, const StageParams& params);

    // docs/stages.md names the buffers. Throw Error whose text names the buffer and the size
    // needed; then no output is written.
    void prepare(const defrec_const_buffer* in, size_t in_count);
    void run(const defrec_const_buffer* in, size_t in_count, const defrec_buffer* out,
             size_t out_count);

  private:
    using Buffers = std::vector<DeviceBuffer>;
    void upload(Buffers& buffers, size_t index, const void* data, uint64_t size);
    static std::vector<const DeviceBuffer*> given(const Buffers& buffers, size_t count);

    StageParams params_;
    std::shared_ptr<const Device> device_;
    Queue queue_;
    DeviceStage stage_;
    Buffers prepared_, in_, out_;
    bool needs_prepare_;
};

}  // namespace defrec
