// A kernel with its grid and arguments, ready to be launched any number of times.
#pragma once
#include <functional>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "backends/cuda/device/device_code.hpp"

namespace defrec::cuda {

struct Grid {
    dim3 blocks, threads;
    size_t shared = 0;         // bytes of dynamic shared memory for each block
    bool cooperative = false;  // all blocks run at once, so that GridBarrier is possible; the
                               // device must hold them
    bool cluster = false;      // all blocks are one cluster, so that ClusterBarrier is possible
};

// As many groups of `side` as cover `count`.
constexpr uint32_t cover(uint64_t count, uint32_t side) {
    return static_cast<uint32_t>((count + side - 1) / side);
}

struct KernelCall {
    Grid grid;
    const void* function = nullptr;
    std::shared_ptr<void> values;  // of the arguments
    std::vector<void*> arguments;  // their addresses, in order
#ifdef DEFREC_CUDA_EMULATED
    std::function<void()> body;  // one thread's work
#endif
};

template <class... Parameters, class... Arguments>
KernelCall make_call(void (*kernel)(Parameters...), const Grid& grid,
                     const Arguments&... arguments) {
    auto values =
        std::make_shared<std::tuple<Parameters...>>(static_cast<Parameters>(arguments)...);
    KernelCall call;
    call.grid = grid;
    call.function = reinterpret_cast<const void*>(kernel);
    std::apply([&](auto&... value) { call.arguments = {static_cast<void*>(&value)...}; }, *values);
#ifdef DEFREC_CUDA_EMULATED
    call.body = [kernel, values] { std::apply(kernel, *values); };
#endif
    call.values = std::move(values);
    return call;
}

}  // namespace defrec::cuda
