// See test_device.hpp.
#include "backends/cuda/gpu/test_device.hpp"

#include <doctest/doctest.h>

#include "backends/cuda/gpu/recorded_stage.hpp"
#include "backends/cuda/gpu/test_gpu.hpp"
#include "backends/shared/test_in_host_memory.hpp"

namespace defrec::under_test {
namespace {

struct Types {
    using Device = cuda::Gpu;
    using Buffer = cuda::Buffer;
    using Queue = cuda::Queue;
    using Stage = cuda::RecordedStage;
};

struct Opened {
    std::string why_none;
    std::unique_ptr<cuda::Gpu> gpu;
    Opened() {
        if (const auto found = test::find_gpu(why_none))
            gpu = std::make_unique<cuda::Gpu>(found->ordinal);
    }
};
Opened& opened() {
    static Opened result;
    return result;
}

}  // namespace

bool available() {
    if (opened().gpu == nullptr) MESSAGE("skipped: no CUDA device: ", opened().why_none);
    return opened().gpu != nullptr;
}

cuda::Gpu& device() {
    if (opened().gpu == nullptr) throw StageError(DEFREC_ERROR_UNSUPPORTED, "no CUDA device");
    return *opened().gpu;
}

std::unique_ptr<Stage> in_host_memory(std::unique_ptr<cuda::Stage> stage) {
    return std::make_unique<test::InHostMemory<Types>>(device(), std::move(stage));
}

}  // namespace defrec::under_test
