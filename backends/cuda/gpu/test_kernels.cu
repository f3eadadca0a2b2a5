// See test_kernels.hpp.
#include "backends/cuda/gpu/test_kernels.hpp"

namespace defrec::cuda {
namespace {

constexpr uint32_t kThreads = 256;
constexpr unsigned kNanoseconds = 20000;

__global__ void slow_add(const uint32_t* in, uint32_t* out, uint32_t count, uint32_t add) {
    __nanosleep(kNanoseconds);
    const uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
    if (i < count) out[i] = in[i] + add;
}

}  // namespace

void record_slow_add(Recorder& recorder, const uint32_t* in, uint32_t* out, uint32_t count,
                     uint32_t add) {
    recorder.launch(slow_add, {dim3(cover(count, kThreads)), dim3(kThreads)}, in, out, count, add);
}

}  // namespace defrec::cuda
