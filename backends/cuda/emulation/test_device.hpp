// The CUDA backend's kernels as backends/agreement tests them without a GPU, on the emulated
// device.
#pragma once
#include <memory>

#include "backends/cuda/stages.hpp"

namespace defrec::under_test {

namespace backend = cuda;
constexpr const char* kBackend = "cuda, emulated";
inline bool available() { return true; }

cuda::Device& device();
std::unique_ptr<Stage> in_host_memory(std::unique_ptr<cuda::Stage> stage);

}  // namespace defrec::under_test

#include "backends/shared/test_device_makers.hpp"
