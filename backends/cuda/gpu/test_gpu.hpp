// The GPU that tests run on.
#pragma once
#include <optional>

#include "backends/cuda/gpu/gpu.hpp"

namespace defrec::test {

// The first that the stages run on. None: why_none says why.
inline std::optional<cuda::GpuInfo> find_gpu(std::string& why_none) {
    for (const cuda::GpuInfo& gpu : cuda::list_gpus(why_none))
        if (gpu.lacks.empty() && gpu.broken.empty()) return gpu;
    return std::nullopt;
}

}  // namespace defrec::test
