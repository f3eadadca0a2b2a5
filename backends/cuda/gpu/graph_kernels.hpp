// Kernels of graphs that belong to no stage.
#pragma once
#include "backends/cuda/gpu/graph.hpp"

namespace defrec::cuda {

// The last of every graph: tells the host that it has run.
KernelCall publish_call(const Progress& progress);
KernelCall fill_call(const Fill& fill);
// Between any two of the device's and the host's page-locked memory.
KernelCall copy_call(void* to, const void* from, uint64_t size);

}  // namespace defrec::cuda
