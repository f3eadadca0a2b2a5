// What a queue has gathered up to a signal, as a CUDA graph.
#pragma once
#include <cuda_runtime_api.h>

#include <span>

#include "backends/cuda/device/device.hpp"
#include "backends/cuda/operations.hpp"

namespace defrec::cuda {

// Counts the graphs that have run, for the host to look at.
struct Progress {
    uint64_t* on_device;         // the count
    volatile uint64_t* on_host;  // page-locked: its copy
};

// Memory of a block beyond what every kernel may ask for has to be allowed, once for each kernel.
void allow_shared(const void* function, size_t shared, const Limits& limits);
// Lets a kernel have clusters of more than eight blocks.
void allow_cluster(const void* function);

class Graph {
  public:
    // Adds one to progress at its end.
    Graph(std::span<const Operation> operations, const Progress& progress, const Limits& limits);
    ~Graph();
    Graph(const Graph&) = delete;
    Graph& operator=(const Graph&) = delete;

    void launch(cudaStream_t stream);

  private:
    cudaGraphExec_t executable_ = nullptr;
};

}  // namespace defrec::cuda
