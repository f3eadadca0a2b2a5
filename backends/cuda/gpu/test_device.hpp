// The GPU that tests of the CUDA backend run on, and its stages in the shape of host-memory
// backends.
#pragma once
#include <memory>

#include "backends/cuda/gpu/gpu.hpp"
#include "backends/cuda/stages.hpp"

namespace defrec::under_test {

namespace backend = cuda;
constexpr const char* kBackend = "cuda";

// False, with a message, where there is no device to test on.
bool available();
cuda::Gpu& device();

std::unique_ptr<Stage> in_host_memory(std::unique_ptr<cuda::Stage> stage);

}  // namespace defrec::under_test

#include "backends/shared/test_device_makers.hpp"
