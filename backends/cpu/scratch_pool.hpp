// Scratch memory of a stage: as many pieces as the host runs calls at a time, not one for each
// call.
#pragma once
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <vector>

#include "backends/shared/stage.hpp"

namespace defrec::cpu {

template <class T>
class ScratchPool {
  public:
    // count: elements of a piece, a cache line apart. max_calls: that there may be at a time.
    ScratchPool(const Host& host, size_t count, size_t max_calls)
        : count_((count * sizeof(T) + 63) / 64 * 64 / sizeof(T)),
          taken_(std::clamp<size_t>(max_calls, 1, host.concurrency())),
          memory_(count_ * taken_.size(), HostAllocator<T>(host)) {}

    // work(T* scratch), of any contents. Any thread; waits where more are inside than the host
    // said.
    template <class Work>
    void lend(Work&& work) {
        size_t place = 0;
        while (taken_[place].test_and_set(std::memory_order_acquire))
            place = (place + 1) % taken_.size();
        work(memory_.data() + place * count_);
        taken_[place].clear(std::memory_order_release);
    }

  private:
    size_t count_;
    std::vector<std::atomic_flag> taken_;
    HostVector<T> memory_;
};

}  // namespace defrec::cpu
