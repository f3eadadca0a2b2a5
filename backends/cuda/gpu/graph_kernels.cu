// See graph_kernels.hpp.
#include <algorithm>

#include "backends/cuda/gpu/graph_kernels.hpp"

namespace defrec::cuda {
namespace {

constexpr uint32_t kThreads = 256, kMaxBlocks = 256;

__global__ void publish(Progress progress) {
    const uint64_t count = *progress.on_device + 1;
    *progress.on_device = count;
    __threadfence_system();
    *progress.on_host = count;
}

// Whole words of the range, then the bytes that are left.
template <class Word>
struct Share {
    uint64_t words, first, step;
    __device__ explicit Share(uint64_t size)
        : words(size / sizeof(Word)),
          first(uint64_t{blockIdx.x} * kThreads + threadIdx.x),
          step(uint64_t{gridDim.x} * kThreads) {}
};

__global__ void __launch_bounds__(kThreads) fill(uint8_t* memory, uint32_t word, uint64_t size) {
    const Share<uint4> share(size);
    for (uint64_t i = share.first; i < share.words; i += share.step)
        reinterpret_cast<uint4*>(memory)[i] = make_uint4(word, word, word, word);
    for (uint64_t i = share.words * sizeof(uint4) + share.first; i < size; i += share.step)
        memory[i] = static_cast<uint8_t>(word);
}

template <class Word>
__global__ void __launch_bounds__(kThreads) copy(uint8_t* to, const uint8_t* from, uint64_t size) {
    const Share<Word> share(size);
    for (uint64_t i = share.first; i < share.words; i += share.step)
        reinterpret_cast<Word*>(to)[i] = reinterpret_cast<const Word*>(from)[i];
    for (uint64_t i = share.words * sizeof(Word) + share.first; i < size; i += share.step)
        to[i] = from[i];
}

Grid grid_for(uint64_t size, size_t word) {
    const uint64_t words = (size + word - 1) / word;
    return {dim3(std::min(kMaxBlocks,
                          cover(std::min<uint64_t>(words, kMaxBlocks * kThreads), kThreads))),
            dim3(kThreads)};
}

}  // namespace

KernelCall publish_call(const Progress& progress) {
    return make_call(publish, {dim3(1), dim3(1)}, progress);
}

KernelCall fill_call(const Fill& given) {
    return make_call(fill, grid_for(given.size, sizeof(uint4)),
                     reinterpret_cast<uint8_t*>(given.memory), 0x01010101u * given.value,
                     given.size);
}

KernelCall copy_call(void* to, const void* from, uint64_t size) {
    const auto call = [&](auto kernel, size_t word) {
        return make_call(kernel, grid_for(size, word), static_cast<uint8_t*>(to),
                         static_cast<const uint8_t*>(from), size);
    };
    const uintptr_t either = reinterpret_cast<uintptr_t>(to) | reinterpret_cast<uintptr_t>(from);
    if (either % sizeof(uint4) == 0) return call(copy<uint4>, sizeof(uint4));
    if (either % sizeof(uint32_t) == 0) return call(copy<uint32_t>, sizeof(uint32_t));
    return call(copy<uint8_t>, sizeof(uint8_t));
}

}  // namespace defrec::cuda
