// The clock of the live link's time stamps.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>

namespace defrec::cli {

// The input's clock as it is, or the system's clock at the first frame with the input's time since,
// so that stamps neither jump nor change their distances when the system's clock is set.
class LinkClock {
  public:
    using Now = std::function<std::chrono::system_clock::time_point()>;
    explicit LinkClock(bool is_system, Now now = &std::chrono::system_clock::now)
        : is_system_(is_system), now_(std::move(now)) {}

    // A frame was taken from the input. The first one sets the clock.
    void take(std::int64_t timestamp_ns) {
        if (!is_system_ || shift_ns_) return;
        const auto since_1970 = now_().time_since_epoch();
        shift_ns_ =
            std::chrono::duration_cast<std::chrono::nanoseconds>(since_1970).count() - timestamp_ns;
    }
    // The stamp of a frame with this time.
    std::int64_t stamp(std::int64_t timestamp_ns) const {
        return timestamp_ns + shift_ns_.value_or(0);
    }

  private:
    bool is_system_;
    Now now_;
    std::optional<std::int64_t> shift_ns_;
};

}  // namespace defrec::cli
