// Runs kernels on the processor: see device_code.hpp.
#pragma once
#include "backends/cuda/device/launch.hpp"

namespace defrec::cuda::emulation {

// Every thread of the grid. Throws std::logic_error where threads wait for others that never come.
void run(const KernelCall& call);

}  // namespace defrec::cuda::emulation
