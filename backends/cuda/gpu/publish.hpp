// The last kernel of every graph: tells the host that it has run.
#pragma once
#include "backends/cuda/gpu/graph.hpp"

namespace defrec::cuda {

KernelCall publish_call(const Progress& progress);

}  // namespace defrec::cuda
