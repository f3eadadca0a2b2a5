// How wrong past predictions were at one horizon, and which kind of prediction was best.
#pragma once
#include <array>
#include <cstddef>
#include <vector>

namespace defrec {

// As DEFREC_PREDICTED_*.
enum class Basis : unsigned char { kLast = 0, kVelocity = 1, kLearned = 2 };
inline constexpr std::size_t kBases = 3;
using ByBasis = std::array<double, kBases>;

class PredictionErrors {
  public:
    PredictionErrors(std::size_t points, double horizon_s);

    // Mean squared errors of each basis, mm^2: of all points that were looked at, and of those that
    // all bases can be compared on. seconds: since the frame before.
    void add_means(const ByBasis& all, const ByBasis& compared, double seconds);
    // A point's squared error, mm^2.
    void add_own(std::size_t point, double squared, double seconds);

    // The best of the bases up to this one.
    Basis best(Basis last) const;
    double mean(Basis basis) const { return mean_[static_cast<std::size_t>(basis)]; }
    double own(std::size_t point) const { return own_[point]; }

  private:
    std::vector<double> own_;  // 0: none yet
    ByBasis mean_{}, compared_{};
    bool is_empty_ = true;
};

}  // namespace defrec
