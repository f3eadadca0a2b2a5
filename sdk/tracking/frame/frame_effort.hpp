// How much of a frame is computed where its time is short.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace defrec {

// Each leaves out what the one before does, and more.
enum class Effort : uint8_t {
    kFull,
    kCoarse,     // without the last search of patches and the pass behind it
    kUnchecked,  // also without the comparison with the left image and the search in the right one
};
constexpr size_t kEfforts = 3;

// What frames take, from how long the last ones did.
class EffortTimes {
  public:
    using Time = std::chrono::duration<double>;

    // The first that is expected to fit; where none is, the last.
    Effort choose(Time left) const;
    // What a frame took from its choice to its end.
    void add(Effort effort, Time took);

  private:
    std::array<Time, kEfforts> expected_{};      // 0: not known yet
    std::array<bool, kEfforts> is_forgotten_{};  // in part
};

// DEFREC_REASON_* of what was left out.
uint32_t reasons_of(Effort effort);

}  // namespace defrec
