// See publish.hpp.
#include "backends/cuda/gpu/publish.hpp"

namespace defrec::cuda {
namespace {

__global__ void publish(Progress progress) {
    const uint64_t count = *progress.on_device + 1;
    *progress.on_device = count;
    __threadfence_system();
    *progress.on_host = count;
}

}  // namespace

KernelCall publish_call(const Progress& progress) { return make_call(publish, {dim3(1), dim3(1)}, progress); }

}  // namespace defrec::cuda
