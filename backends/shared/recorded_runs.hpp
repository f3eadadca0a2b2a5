// What a stage of a device recorded, for each set of buffers that it was run with.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <list>
#include <span>
#include <utility>
#include <vector>

namespace defrec {

// Buffer: has serial(), never 0 and never that of another, not even of one that is gone.
template <class Run, class Buffer>
class RecordedRuns {
  public:
    // nullptr: an optional buffer that was not given.
    using Buffers = std::span<const Buffer* const>;

    // That for these buffers, which thereby becomes the last used; nullptr: there is none.
    const Run* find(Buffers in, Buffers out) {
        const auto found = std::find_if(known_.begin(), known_.end(), [&](const Known& known) {
            return same(known.in, in) && same(known.out, out);
        });
        if (found == known_.end()) return nullptr;
        known_.splice(known_.begin(), known_, found);
        return &known_.front().run;
    }
    const Run& add(Buffers in, Buffers out, Run run) {
        known_.push_front({serials(in), serials(out), std::move(run)});
        return known_.front().run;
    }
    size_t size() const { return known_.size(); }
    // The one that was used longest ago.
    void drop_last() { known_.pop_back(); }
    void clear() { known_.clear(); }

  private:
    using Serials = std::vector<uint64_t>;  // 0: not given
    struct Known {
        Serials in, out;
        Run run;
    };
    static uint64_t serial(const Buffer* buffer) {
        return buffer == nullptr ? 0 : buffer->serial();
    }
    static Serials serials(Buffers buffers) {
        Serials result;
        std::transform(buffers.begin(), buffers.end(), std::back_inserter(result), serial);
        return result;
    }
    static bool same(const Serials& known, Buffers given) {
        return std::equal(
            given.begin(), given.end(), known.begin(), known.end(),
            [](const Buffer* buffer, uint64_t number) { return serial(buffer) == number; });
    }
    std::list<Known> known_;  // the last used first
};

}  // namespace defrec
