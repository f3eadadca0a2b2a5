// The state of a frame as the report says it: as the live view said it in that frame.
#pragma once

#include <string>
#include <string_view>

#include "sdk/report/record.hpp"
#include "sdk/report/shown_state.hpp"

namespace defrec::cli {

class ToldState {
  public:
    /// Takes one frame after the other; returns a name of state_words().
    std::string take(const FrameRecord& frame);

  private:
    ShownState shown_;
};

/// The frame's reasons, and that errors of points are large where this makes it "degraded". told:
/// as ToldState says it.
std::string reasons_told(const FrameRecord& frame, const std::string& told);

/// Which frames the top of the page tells of together, in this order.
enum class Doubt { lost, frozen, unusable, degraded, none };
/// state: as ToldState says it.
Doubt doubt_of(std::string_view state);

}  // namespace defrec::cli
