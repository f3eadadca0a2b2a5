// Which frames are lost, degraded or without a template, why, and what to do: in words, for a
// person.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace defrec::cli {

/// At most so many are named where there is room for a few lines.
constexpr std::size_t kDoubtfulFramesSaid = 3;

/// Frames of a state with the same main reason of the same picture.
struct DoubtfulFrames {
    std::string state;   ///< "lost", "initialising" or "degraded"
    std::string reason;  ///< a name of DEFREC_REASON_*; empty: none that explains the state
    std::string why;     ///< "both pictures are black; check light, lens and cable"
    std::int64_t first = 0, last = 0;
    std::int64_t count = 0;  ///< of the frames from first to last
    std::int64_t span = 0;   ///< frames from first to last, whatever their state

    /// "frames 20 to 39", "31 of the frames 20 to 90"
    std::string where() const;
};

/// Collects them, frame by frame.
class DoubtfulFramesList {
  public:
    /// state: "unfound" for a lost frame before any that was followed, which is listed as lost.
    /// reasons, faulty_views: as in told_reasons().
    void add(std::int64_t frame, std::string_view state, std::string_view reasons,
             std::string_view faulty_views);
    /// In the order of these states, and of each those with the most frames first.
    std::vector<DoubtfulFrames> sorted() const;

  private:
    struct Item {
        DoubtfulFrames frames;
        std::int64_t first_at = 0;  ///< counted from the first frame that was added
    };
    std::int64_t frames_ = 0;
    std::vector<Item> items_;
};

}  // namespace defrec::cli
