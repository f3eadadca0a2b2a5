// What a queue gathers between two signals, and which of it has to wait for which.
#pragma once
#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "backends/cuda/device/recorder.hpp"

namespace defrec::cuda {

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

// For each operation those before it that it waits for: whose writes it reads or writes, or whose
// reads it writes, or which share the memory of a stage. Those that others in the list wait for
// already are left out.
std::vector<std::vector<size_t>> dependencies(std::span<const Operation> operations);
// For what a node of operation `which`, a run, records early: those before it that write what the
// node reads, and those that share the memory of its stage.
std::vector<size_t> early_dependencies(std::span<const Operation> operations, size_t which,
                                       const Node& node);

}  // namespace defrec::cuda
