// A device that the processor plays, for tests of kernels where there is no GPU.
#pragma once
#include "backends/cuda/device/device.hpp"
#include "backends/cuda/device/recorder.hpp"

namespace defrec::cuda {

class EmulatedDevice final : public Device {
  public:
    // The least that a card of compute capability 7.5 has, so that what fits here fits everywhere;
    // few multiprocessors, to be quick.
    EmulatedDevice() : EmulatedDevice({4, 64 * 1024, 64 * 1024, 75}) {}
    explicit EmulatedDevice(const Limits& limits) : limits_(limits) {}

    const Limits& limits() const override { return limits_; }
    std::byte* allocate(uint64_t size) override;
    void release(std::byte* memory) noexcept override;
    void copy_to_device(std::byte* to, const void* from, uint64_t size) override;
    void clear(std::byte* memory, uint64_t size) override;
    uint32_t resident_blocks(const void* function, uint32_t threads, size_t shared) const override;
    bool holds_cluster(const void* function, uint32_t blocks, uint32_t threads,
                       size_t shared) const override;

  private:
    Limits limits_;
};

// Everything in a recording, one after the other.
void run(const Recording& recording);

}  // namespace defrec::cuda
