// Memory of a stage that it may not need.
#pragma once
#include <algorithm>
#include <cstddef>
#include <memory>

#include "backends/shared/stage.hpp"

namespace defrec::cpu {

// From the host's allocator, cache-line aligned; not written to begin with, so that what is never
// used of it takes no room.
template <class T>
class HostBlock {
  public:
    HostBlock(const Host& host, size_t count)
        : memory_(static_cast<T*>(host.allocate(std::max<size_t>(count, 1) * sizeof(T), 64)),
                  {host}) {}
    T* data() const { return memory_.get(); }

  private:
    struct Release {
        Host host;
        void operator()(T* memory) const { host.release(memory); }
    };
    std::unique_ptr<T, Release> memory_;
};

}  // namespace defrec::cpu
