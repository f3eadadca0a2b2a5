// Which frames' pictures the report shows: some evenly spread, and those where the state changed.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sdk/report/thinning.hpp"

namespace defrec::cli {

struct KeyFrame {
    std::int64_t frame = 0;
    double timestamp_ms = 0;
    std::string state, reasons, faulty_views;
    bool state_changed = false;
    std::vector<std::uint8_t> jpeg;
};

class KeyFrames {
  public:
    static constexpr std::size_t kEven = 7, kChanges = 7;

    /// Asks about the next frame; true: its picture is wanted and add() must follow.
    bool wants(std::int64_t frame, const std::string& state);
    void add(KeyFrame picture);

    /// In order of time; evenly spread ones that lie close to a change are left out.
    std::vector<KeyFrame> sorted() const;

  private:
    EvenlyThinned<KeyFrame> even_{kEven};
    std::vector<KeyFrame> changes_;
    std::string last_state_;
    bool any_ = false, as_change_ = false;
};

}  // namespace defrec::cli
