// Times of a sequence in which no picture came.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

namespace defrec::cli {

class PictureGaps {
  public:
    /// Shorter ones are single frames that were dropped: of them the reason "gap" tells.
    static constexpr double kLeastMs = 1000;
    static constexpr std::size_t kListed = 50;

    struct Gap {
        double from_ms = 0, to_ms = 0;  ///< of the pictures before and after it
    };

    /// Takes one frame after the other. reasons: names with ", " or '|' between them.
    void add(double timestamp_ms, std::string_view reasons);

    /// The first ones.
    const std::vector<Gap>& listed() const { return listed_; }
    std::size_t count() const { return count_; }
    double total_ms() const { return total_ms_; }

  private:
    std::optional<double> last_ms_;
    std::vector<Gap> listed_;
    std::size_t count_ = 0;
    double total_ms_ = 0;
};

}  // namespace defrec::cli
