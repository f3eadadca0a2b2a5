// Records the work of a stage, once for each set of buffers it is run with: kernels and what each
// has to wait for.
#pragma once
#include <algorithm>
#include <cstdint>
#include <variant>
#include <vector>

#include "backends/cuda/device/launch.hpp"

namespace defrec::cuda {

struct Fill {
    std::byte* memory;  // at a multiple of 16
    uint8_t value;
    uint64_t size;
};
struct Copy {  // within the device
    std::byte* to;
    const std::byte* from;
    uint64_t size;
};

struct MemoryRange {
    const std::byte* first;
    uint64_t size;
};
template <class T>
MemoryRange range_of(const T* first, uint64_t count) {
    return {reinterpret_cast<const std::byte*>(first), first != nullptr ? count * sizeof(T) : 0};
}

struct Node {
    std::variant<KernelCall, Fill, Copy> work;
    std::vector<uint32_t> after;     // earlier nodes of the recording
    bool first;                      // waits for what the run waits for, too; if early, for less
    std::vector<MemoryRange> early;  // see Recorder::early; empty: it is not
};

// nodes in an order in which they may run.
struct Recording {
    std::vector<Node> nodes;
    std::vector<uint32_t> last;  // those that no other waits for
};

// Each operation waits for the one before it; the parts of `beside` run beside each other.
class Recorder {
  public:
    explicit Recorder(Recording& recording) : recording_(recording) {}

    template <class... Parameters, class... Arguments>
    void launch(void (*kernel)(Parameters...), const Grid& grid, const Arguments&... arguments) {
        if (empty(grid.blocks)) return;
        add(make_call(kernel, grid, arguments...));
    }
    void fill(void* memory, uint8_t value, uint64_t size) {
        if (size != 0) add(Fill{static_cast<std::byte*>(memory), value, size});
    }
    void copy(void* to, const void* from, uint64_t size) {
        if (size != 0 && to != from)
            add(Copy{static_cast<std::byte*>(to), static_cast<const std::byte*>(from), size});
    }
    // Each part is a function that records; none may read or write what another writes. What
    // follows waits for all.
    template <class... Parts>
    void beside(Parts&&... parts) {
        const std::vector<uint32_t> before = recording_.last;
        std::vector<uint32_t> after;
        const auto record = [&](auto&& part) {
            recording_.last = before;
            part();
            for (const uint32_t node : recording_.last)
                if (std::find(after.begin(), after.end(), node) == after.end())
                    after.push_back(node);
        };
        (record(parts), ...);
        recording_.last = after;
    }

    // What `part` records reads these of the run's inputs and no others, and writes the stage's own
    // memory alone: it need not wait for the other inputs. To be called before anything else is
    // recorded; not for a stage that is reentrant.
    template <class Part>
    void early(std::vector<MemoryRange> reads, Part&& part) {
        early_ = std::move(reads);
        part();
        early_.clear();
    }

  private:
    static bool empty(const dim3& size) { return size.x == 0 || size.y == 0 || size.z == 0; }
    template <class Work>
    void add(Work&& work) {
        const std::vector<uint32_t>& after = recording_.last;
        const bool first = std::all_of(after.begin(), after.end(), [this](uint32_t node) {
            return !recording_.nodes[node].early.empty();
        });
        recording_.nodes.push_back({std::forward<Work>(work), after, first, early_});
        recording_.last.assign(1, static_cast<uint32_t>(recording_.nodes.size() - 1));
    }
    Recording& recording_;
    std::vector<MemoryRange> early_;
};

}  // namespace defrec::cuda
