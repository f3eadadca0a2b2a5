// The CUDA backend's kernels as backends/agreement tests them without a GPU, on the emulated device.
#pragma once
#include <memory>

#include "backends/cuda/stages.hpp"

namespace defrec::under_test {

constexpr const char* kBackend = "cuda, emulated";
constexpr bool kReadsCounts = false;  // only the device knows the numbers in buffers
inline bool available() { return true; }

template <class Check>
void on_every_target(Check&& check) {
    check();
}

cuda::Device& device();
std::unique_ptr<Stage> in_host_memory(std::unique_ptr<cuda::Stage> stage);

}  // namespace defrec::under_test

#include "backends/cuda/under_test_makers.hpp"
