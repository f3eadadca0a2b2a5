// What a queue has gathered up to a signal, as a CUDA graph: operations wait for those before them whose memory they touch, and for no others.
#pragma once
#include <cuda_runtime_api.h>

#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "backends/cuda/device.hpp"
#include "backends/cuda/recorder.hpp"

namespace defrec::cuda {

struct MemoryRange {
    const std::byte* first;
    uint64_t size;
};

// A stage's work on one set of buffers.
struct StageRun {
    uint64_t serial;  // never given twice
    uint64_t stage;   // runs of one stage wait for each other, unless it is reentrant; 0: reentrant
    Recording recording;
    std::vector<MemoryRange> reads, writes;
};
struct Upload {
    std::byte* to;
    const void* from;  // page-locked
    uint64_t size;
};
struct Download {
    void* to;  // page-locked
    const std::byte* from;
    uint64_t size;
};
using Operation = std::variant<std::shared_ptr<const StageRun>, Upload, Download>;

// Counts the graphs that have run, for the host to look at.
struct Progress {
    uint64_t* on_device;         // the count
    volatile uint64_t* on_host;  // page-locked: its copy
};

// Memory of a block beyond what every kernel may ask for has to be allowed, once for each kernel.
void allow_shared(const void* function, size_t shared, const Limits& limits);

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
