// The emulation of CUDA's threads does what a GPU does.
#include <doctest/doctest.h>

#include <numeric>
#include <stdexcept>
#include <vector>

#include "backends/cuda/emulation/block.hpp"

using namespace defrec::cuda;

namespace {

template <class... Parameters, class... Arguments>
void launch(void (*kernel)(Parameters...), const Grid& grid, const Arguments&... arguments) {
    emulation::run(make_call(kernel, grid, arguments...));
}

__global__ void sum_of_block(const int* in, int* out) {
    __shared__ int warp_sums[32];
    const uint32_t thread = threadIdx.x + threadIdx.y * blockDim.x;
    int sum = in[blockIdx.x * blockDim.x * blockDim.y + thread];
    for (int by = 16; by > 0; by /= 2)
        sum += __shfl_down_sync(kAllLanes, sum, static_cast<uint32_t>(by));
    if (thread % kWarp == 0) warp_sums[thread / kWarp] = sum;
    __syncthreads();
    if (thread != 0) return;
    for (uint32_t warp = 1; warp < blockDim.x * blockDim.y / kWarp; ++warp) sum += warp_sums[warp];
    out[blockIdx.x] = sum;
}

__global__ void rotate_through_dynamic(int* values) {
    int* const shared = dynamic_shared<int>();
    for (uint32_t step = 0; step < blockDim.x; ++step) {
        shared[threadIdx.x] = values[threadIdx.x];
        __syncthreads();
        values[threadIdx.x] = shared[(threadIdx.x + 1) % blockDim.x];
        __syncthreads();
    }
}

__global__ void half_warps(int* out) {
    const uint32_t mask = threadIdx.x < 16 ? 0x0000ffffu : 0xffff0000u;
    int value = static_cast<int>(threadIdx.x);
    if (threadIdx.x < 16)
        for (int i = 0; i < 3; ++i) value = __shfl_xor_sync(mask, value, 1, 16);
    else
        value = __shfl_sync(mask, value, 5, 16);
    out[threadIdx.x] = value;
}

__global__ void relay_over_grid(int* values) {
    __shared__ int own;
    GridBarrier barrier(nullptr);
    for (uint32_t step = 0; step < gridDim.x; ++step) {
        if (threadIdx.x == 0) own = values[blockIdx.x];
        barrier.wait();
        if (threadIdx.x == 1) values[(blockIdx.x + 1) % gridDim.x] = own + 1;
        barrier.wait();
    }
}

__global__ void some_leave(int* out) {
    if (threadIdx.x >= 40) return;
    const int here = __syncthreads_count(threadIdx.x % 2 == 0);
    out[threadIdx.x] = here;
}

__global__ void half_waits() {
    if (threadIdx.x < 32)
        __syncthreads();
    else if (threadIdx.x < 48)
        __syncwarp();
}

}  // namespace

TEST_CASE("blocks have their own shared memory, warps exchange") {
    std::vector<int> in(7 * 96), out(7);
    std::iota(in.begin(), in.end(), 0);
    launch(sum_of_block, {dim3(7), dim3(32, 3)}, in.data(), out.data());
    for (int block = 0; block < 7; ++block) CHECK(out[size_t(block)] == 96 * 96 * block + 95 * 48);
}

TEST_CASE("dynamic shared memory and barriers") {
    std::vector<int> values(70);
    std::iota(values.begin(), values.end(), 0);
    const std::vector<int> before = values;
    launch(rotate_through_dynamic, {dim3(1), dim3(70), 70 * sizeof(int)}, values.data());
    CHECK(values == before);
}

TEST_CASE("parts of a warp exchange by themselves") {
    std::vector<int> out(32);
    launch(half_warps, {dim3(1), dim3(32)}, out.data());
    for (int i = 0; i < 16; ++i) CHECK(out[size_t(i)] == (i ^ 1));
    for (int i = 16; i < 32; ++i) CHECK(out[size_t(i)] == 16 + 5);
}

TEST_CASE("a cooperative grid waits for all its blocks") {
    std::vector<int> values(5);
    launch(relay_over_grid, {dim3(5), dim3(64), 0, true}, values.data());
    for (const int value : values) CHECK(value == 5);
}

TEST_CASE("threads that have ended are not waited for") {
    std::vector<int> out(40);
    launch(some_leave, {dim3(1), dim3(64)}, out.data());
    for (const int value : out) CHECK(value == 20);
}

TEST_CASE("a wait that nobody ends is found") {
    CHECK_THROWS_AS(launch(half_waits, {dim3(1), dim3(64)}), std::logic_error);
}
