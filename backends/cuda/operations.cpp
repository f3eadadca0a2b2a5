// See operations.hpp.
#include "backends/cuda/operations.hpp"

namespace defrec::cuda {
namespace {

struct Touched {
    uint64_t stage = 0;
    std::vector<MemoryRange> reads, writes;
};

Touched touched(const Operation& operation) {
    if (const auto* upload = std::get_if<Upload>(&operation))
        return {0,
                {{static_cast<const std::byte*>(upload->from), upload->size}},
                {{upload->to, upload->size}}};
    if (const auto* download = std::get_if<Download>(&operation))
        return {0,
                {{download->from, download->size}},
                {{static_cast<const std::byte*>(download->to), download->size}}};
    const StageRun& run = *std::get<std::shared_ptr<const StageRun>>(operation);
    return {run.stage, run.reads, run.writes};
}

bool overlap(std::span<const MemoryRange> some, std::span<const MemoryRange> others) {
    for (const MemoryRange& a : some)
        for (const MemoryRange& b : others)
            if (a.first < b.first + b.size && b.first < a.first + a.size) return true;
    return false;
}

bool must_wait(const Touched& later, const Touched& earlier) {
    return (later.stage != 0 && later.stage == earlier.stage) ||
           overlap(later.reads, earlier.writes) || overlap(later.writes, earlier.writes) ||
           overlap(later.writes, earlier.reads);
}

}  // namespace

std::vector<std::vector<size_t>> dependencies(std::span<const Operation> operations) {
    const size_t count = operations.size();
    std::vector<Touched> memory;
    for (const Operation& operation : operations) memory.push_back(touched(operation));
    std::vector<std::vector<size_t>> result(count);
    std::vector<std::vector<bool>> after(
        count, std::vector<bool>(count));  // [i][j]: i comes after j, by whatever way
    for (size_t i = 0; i < count; ++i)
        for (size_t j = i; j-- > 0;) {
            if (after[i][j] || !must_wait(memory[i], memory[j])) continue;
            result[i].push_back(j);
            after[i][j] = true;
            for (size_t k = 0; k < j; ++k)
                if (after[j][k]) after[i][k] = true;
        }
    return result;
}

std::vector<size_t> early_dependencies(std::span<const Operation> operations, size_t which,
                                       const Node& node) {
    const Touched early{touched(operations[which]).stage, node.early, {}};
    std::vector<size_t> result;
    for (size_t i = 0; i < which; ++i)
        if (must_wait(early, touched(operations[i]))) result.push_back(i);
    return result;
}

}  // namespace defrec::cuda
