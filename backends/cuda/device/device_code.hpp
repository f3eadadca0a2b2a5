// The language of the kernels: CUDA's, from nvcc, or emulated for a plain C++ compiler.
#pragma once
#ifdef DEFREC_CUDA_EMULATED
#include "backends/cuda/device/emulated_code.hpp"
#else
#include <cuda_runtime.h>

#include <cstdint>

#ifdef __CUDACC__
namespace defrec::cuda {

// The block's dynamic shared memory, Grid::shared bytes, 16-byte aligned.
template <class T>
__device__ T* dynamic_shared() {
    extern __shared__ __align__(16) unsigned char dynamic_shared_bytes[];
    return reinterpret_cast<T*>(dynamic_shared_bytes);
}

// A barrier of all threads of the grid; only in kernels launched with Grid::cooperative. Blocks
// tell each other by a count each, which is sooner known to all than a sum that they add to one
// after the other.
class GridBarrier {
  public:
    static constexpr bool kSharesMemory = false;
    // passed: of each block, 0 before the first launch; one grid at a time uses it.
    __device__ explicit GridBarrier(uint32_t* passed)
        : passed_(passed), count_(passed[blockIdx.x]) {}
    __device__ void wait() {
        ++count_;
        __syncthreads();
        if (threadIdx.x == 0)
            asm volatile("st.release.gpu.global.u32 [%0], %1;" ::"l"(passed_ + blockIdx.x),
                         "r"(count_)
                         : "memory");
        for (uint32_t block = threadIdx.x; block < gridDim.x; block += blockDim.x) {
            uint32_t there;
            do
                asm volatile("ld.acquire.gpu.global.u32 %0, [%1];"
                             : "=r"(there)
                             : "l"(passed_ + block)
                             : "memory");
            while (static_cast<int32_t>(there - count_) < 0);  // one that is ahead has passed it
        }
        __syncthreads();
    }

  private:
    uint32_t* passed_;
    uint32_t count_;
};

// The same for the threads of a cluster, whose blocks reach each other's shared memory; only in
// kernels launched with Grid::cluster, on devices that have clusters.
class ClusterBarrier {
  public:
    static constexpr bool kSharesMemory = true;
    __device__ explicit ClusterBarrier(uint32_t*) {}
    // What lies at that place of this block's shared memory, in block `rank` of the cluster.
    __device__ static float load(const float* place, uint32_t rank) {
        float value = 0;
#if __CUDA_ARCH__ >= 900
        asm volatile("ld.shared::cluster.f32 %0, [%1];"
                     : "=f"(value)
                     : "r"(address(place, rank))
                     : "memory");
#endif
        return value;
    }
    __device__ static void store(float4* place, uint32_t rank, float4 value) {
#if __CUDA_ARCH__ >= 900
        asm volatile(
            "st.shared::cluster.v4.f32 [%0], {%1, %2, %3, %4};" ::"r"(address(place, rank)),
            "f"(value.x), "f"(value.y), "f"(value.z), "f"(value.w)
            : "memory");
#endif
    }
    // A thread releases for all of its block, which is quicker than each for itself.
    __device__ void wait() {
#if __CUDA_ARCH__ >= 900
        __syncthreads();
        if (threadIdx.x == 0) asm volatile("fence.acq_rel.cluster;" ::: "memory");
        __syncwarp();
        asm volatile("barrier.cluster.arrive.relaxed.aligned;" ::: "memory");
        asm volatile("barrier.cluster.wait.acquire.aligned;" ::: "memory");
#else
        __trap();
#endif
    }

  private:
    __device__ static uint32_t address(const void* place, uint32_t rank) {
        uint32_t there = 0;
#if __CUDA_ARCH__ >= 900
        asm("mapa.shared::cluster.u32 %0, %1, %2;"
            : "=r"(there)
            : "r"(static_cast<uint32_t>(__cvta_generic_to_shared(place))), "r"(rank));
#endif
        return there;
    }
};

}  // namespace defrec::cuda
#endif
#endif

namespace defrec::cuda {

constexpr uint32_t kWarp = 32;
constexpr uint32_t kAllLanes = 0xffffffff;

}  // namespace defrec::cuda
