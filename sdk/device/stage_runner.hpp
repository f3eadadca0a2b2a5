// One stage on its own, on host memory: buffers of the device that follow the caller's, up, run,
// down. No call takes longer than the plugin's deadline.
#pragma once
#include <memory>

#include "sdk/device/context.hpp"
#include "sdk/device/stage_params.hpp"

namespace defrec {

// One thread at a time.
class StageRunner {
  public:
    // Opens the device.
    StageRunner(const DeviceChoice& device, const StageParams& params);

    // docs/stages.md names the buffers. Throw Error whose text names the buffer and the size
    // needed; then no output is written.
    void prepare(const defrec_const_buffer* in, size_t in_count);
    void run(const defrec_const_buffer* in, size_t in_count, const defrec_buffer* out,
             size_t out_count);

  private:
    class Work;
    template <class Body>
    void within_deadline(const char* call, Body&& body) const;

    DeviceChoice device_;
    StageParams params_;
    std::shared_ptr<Work> work_;
    bool needs_prepare_;
};

}  // namespace defrec
