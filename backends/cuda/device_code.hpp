// The language of the kernels: CUDA's, from nvcc, or what emulation/ has of it for a plain C++
// compiler.
#pragma once
#ifdef DEFREC_CUDA_EMULATED
#include "backends/cuda/emulation/device_code.hpp"
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
    // passed: of each block, 0 before the first launch. Of one grid at a time.
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

}  // namespace defrec::cuda
#endif
#endif

namespace defrec::cuda {

constexpr uint32_t kWarp = 32;
constexpr uint32_t kAllLanes = 0xffffffff;

}  // namespace defrec::cuda
