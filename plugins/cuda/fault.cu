// See fault.hpp.
#include <cuda_runtime.h>

#include "plugins/cuda/fault.hpp"

namespace defrec::test {
namespace {

__global__ void fault_kernel(Fault fault, int* nowhere) {
    if (fault == Fault::trap) __trap();
    *nowhere = 1;
}

}  // namespace

bool cause(Fault fault, int ordinal) {
    if (cudaSetDevice(ordinal) != cudaSuccess) return false;
    fault_kernel<<<1, 1>>>(fault, nullptr);
    return cudaDeviceSynchronize() != cudaSuccess;
}

}  // namespace defrec::test
