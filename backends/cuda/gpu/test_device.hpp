// The GPU that tests of the CUDA backend run on, and its stages in the shape of host-memory backends.
#pragma once
#include <memory>

#include "backends/cuda/gpu/gpu.hpp"
#include "backends/cuda/stages.hpp"

namespace defrec::under_test {

constexpr const char* kBackend = "cuda";
constexpr bool kReadsCounts = false;  // only the device knows the numbers in buffers

// False, with a message, where there is no device to test on.
bool available();
cuda::Gpu& device();

// Calls check() for everything that the backend's code may run on.
template <class Check>
void on_every_target(Check&& check) {
    check();
}

std::unique_ptr<Stage> in_host_memory(std::unique_ptr<cuda::Stage> stage);

}  // namespace defrec::under_test

#include "backends/cuda/under_test_makers.hpp"
