// See graph_kernels.hpp.
#include <algorithm>

#include "backends/cuda/gpu/graph_kernels.hpp"

namespace defrec::cuda {
namespace {

constexpr uint32_t kThreads = 256, kMaxBlocks = 256;

// Whole words of the range, then the bytes that are left.
template <class Word>
struct Share {
    uint64_t words, first, step;
    __device__ Share(uint64_t size, uint64_t block, uint64_t blocks)
        : words(size / sizeof(Word)),
          first(block * kThreads + threadIdx.x),
          step(blocks * kThreads) {}
};
// Of which both addresses are multiples.
__host__ __device__ size_t word_size(const void* to, const void* from) {
    const uintptr_t either = reinterpret_cast<uintptr_t>(to) | reinterpret_cast<uintptr_t>(from);
    return either % sizeof(uint4) == 0      ? sizeof(uint4)
           : either % sizeof(uint32_t) == 0 ? sizeof(uint32_t)
                                            : 1;
}

template <class Word>
__device__ void copy_share(uint8_t* to, const uint8_t* from, uint64_t size, uint64_t block,
                           uint64_t blocks) {
    const Share<Word> share(size, block, blocks);
    for (uint64_t i = share.first; i < share.words; i += share.step)
        reinterpret_cast<Word*>(to)[i] = reinterpret_cast<const Word*>(from)[i];
    for (uint64_t i = share.words * sizeof(Word) + share.first; i < size; i += share.step)
        to[i] = from[i];
}

// What blocks first_block on copy, up to the next one's.
struct Delivery {
    uint8_t* to;
    const uint8_t* from;
    uint64_t size;
    uint32_t first_block;
};
struct Deliveries {
    Delivery of[kMaxDelivered + 1];  // the last one's end
    uint32_t count;
};

__global__ void __launch_bounds__(kThreads) publish(Progress progress, Deliveries deliveries) {
    if (deliveries.count > 0) {
        uint32_t which = 0;
        while (blockIdx.x >= deliveries.of[which + 1].first_block) ++which;
        const Delivery& its = deliveries.of[which];
        const uint32_t block = blockIdx.x - its.first_block,
                       blocks = deliveries.of[which + 1].first_block - its.first_block;
        switch (word_size(its.to, its.from)) {
            case sizeof(uint4):
                copy_share<uint4>(its.to, its.from, its.size, block, blocks);
                break;
            case sizeof(uint32_t):
                copy_share<uint32_t>(its.to, its.from, its.size, block, blocks);
                break;
            default:
                copy_share<uint8_t>(its.to, its.from, its.size, block, blocks);
        }
        __threadfence_system();
        __syncthreads();
    }
    if (threadIdx.x != 0 || atomicAdd(&progress.on_device->blocks, 1u) + 1 < gridDim.x) return;
    const uint64_t count = progress.on_device->count + 1;
    *progress.on_device = {count, 0};
    __threadfence_system();
    *progress.on_host = count;
}

__global__ void __launch_bounds__(kThreads) fill(uint8_t* memory, uint32_t word, uint64_t size) {
    const Share<uint4> share(size, blockIdx.x, gridDim.x);
    for (uint64_t i = share.first; i < share.words; i += share.step)
        reinterpret_cast<uint4*>(memory)[i] = make_uint4(word, word, word, word);
    for (uint64_t i = share.words * sizeof(uint4) + share.first; i < size; i += share.step)
        memory[i] = static_cast<uint8_t>(word);
}

template <class Word>
__global__ void __launch_bounds__(kThreads) copy(uint8_t* to, const uint8_t* from, uint64_t size) {
    copy_share<Word>(to, from, size, blockIdx.x, gridDim.x);
}

uint32_t blocks_for(uint64_t size, size_t word) {
    const uint64_t words = (size + word - 1) / word;
    return std::min(kMaxBlocks, cover(std::min<uint64_t>(words, kMaxBlocks * kThreads), kThreads));
}
Grid grid_for(uint64_t size, size_t word) { return {dim3(blocks_for(size, word)), dim3(kThreads)}; }

}  // namespace

KernelCall publish_call(const Progress& progress, std::span<const Download> results) {
    Deliveries deliveries{};
    uint32_t blocks = 0;
    for (const Download& result : results) {
        deliveries.of[deliveries.count++] = {static_cast<uint8_t*>(result.to),
                                             reinterpret_cast<const uint8_t*>(result.from),
                                             result.size, blocks};
        blocks += blocks_for(result.size, sizeof(uint4));
    }
    deliveries.of[deliveries.count].first_block = blocks;
    return make_call(publish, {dim3(std::max(blocks, 1u)), dim3(kThreads)}, progress, deliveries);
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
    const size_t word = word_size(to, from);
    if (word == sizeof(uint4)) return call(copy<uint4>, word);
    if (word == sizeof(uint32_t)) return call(copy<uint32_t>, word);
    return call(copy<uint8_t>, word);
}

}  // namespace defrec::cuda
