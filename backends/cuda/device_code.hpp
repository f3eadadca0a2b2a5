// The language of the kernels: CUDA's, from nvcc, or what emulation/ has of it for a plain C++
// compiler.
#pragma once
#ifdef DEFREC_CUDA_EMULATED
#include "backends/cuda/emulation/device_code.hpp"
#else
#include <cuda_runtime.h>

#include <cstdint>

#ifdef __CUDACC__
#include <cooperative_groups.h>

namespace defrec::cuda {

// The block's dynamic shared memory, Grid::shared bytes, 16-byte aligned.
template <class T>
__device__ T* dynamic_shared() {
    extern __shared__ __align__(16) unsigned char dynamic_shared_bytes[];
    return reinterpret_cast<T*>(dynamic_shared_bytes);
}

// Every thread of the grid; only in kernels launched with Grid::cooperative.
__device__ inline void sync_grid() { cooperative_groups::this_grid().sync(); }

}  // namespace defrec::cuda
#endif
#endif

namespace defrec::cuda {

constexpr uint32_t kWarp = 32;
constexpr uint32_t kAllLanes = 0xffffffff;

}  // namespace defrec::cuda
