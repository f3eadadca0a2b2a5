// Kernels that only tests run.
#pragma once
#include "backends/cuda/device/recorder.hpp"

namespace defrec::cuda {

// out[i] = in[i] + add, by blocks that take their time.
void record_slow_add(Recorder& recorder, const uint32_t* in, uint32_t* out, uint32_t count,
                     uint32_t add);

}  // namespace defrec::cuda
