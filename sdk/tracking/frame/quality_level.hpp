// How much of a frame is computed where its time is short.
#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace defrec {

// Each leaves out what the one before does, and more.
enum class QualityLevel : uint8_t {
    kFull,
    kCoarse,     // without the last search of patches and the pass behind it
    kUnchecked,  // also without the comparison with the left image and the search in the right one
};
constexpr size_t kQualityLevels = 3;

// The times that frames take, from how long the last ones did.
class QualityLevelTimes {
  public:
    using Time = std::chrono::duration<double>;

    // The first that is expected to fit; where none is, the last.
    QualityLevel choose(Time left) const;
    // The time that a frame took from its choice to its end.
    void add(QualityLevel quality_level, Time took);

  private:
    std::array<Time, kQualityLevels> expected_{};      // 0: not known yet
    std::array<bool, kQualityLevels> is_forgotten_{};  // in part
};

// DEFREC_REASON_* of what was left out.
uint32_t reasons_of(QualityLevel quality_level);

}  // namespace defrec
