// When to try again what often fails: less and less often where it does.
#pragma once
#include <algorithm>
#include <cstdint>

namespace defrec {

class Backoff {
  public:
    explicit Backoff(uint32_t longest_pause) : longest_pause_(longest_pause) {}

    // Once for each occasion; true: it is taken, and its end reported.
    bool is_due() {
        if (left_ == 0) return true;
        --left_;
        return false;
    }
    void end(bool has_succeeded) {
        pause_ = has_succeeded ? 0 : std::clamp(2 * pause_, uint32_t{1}, longest_pause_);
        left_ = pause_;
    }

  private:
    const uint32_t longest_pause_;  // occasions
    uint32_t pause_ = 0, left_ = 0;
};

}  // namespace defrec
