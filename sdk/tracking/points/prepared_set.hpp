// Points that are moved in many frames, with what is worked out of them once: those of
// defrec_targets_create(), and sets that defrec_job_warp_points() is given again and again.
#pragma once
#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include "sdk/tracking/points/point_carrier.hpp"

namespace defrec {

class Services;

// With one template and the body that it had.
struct PreparedSet {
    std::shared_ptr<const Template> surface;
    std::shared_ptr<const Body> body;  // null: there is none
    std::vector<PreparedPoint> points;
    std::vector<DeepPoint> deep;

    PreparedPoints view() const { return {points, deep}; }
};
// xyz: of `count` points. helpers: whose threads take part; may be null.
std::shared_ptr<const PreparedSet> prepare_set(std::shared_ptr<const Template> surface,
                                               std::shared_ptr<const Body> body, const double* xyz,
                                               size_t count, const Services* helpers);

// The sets that were asked for last. Any thread.
class PreparedSets {
  public:
    // Sets of fewer points are prepared faster than they are looked up; larger ones would take too
    // much memory, as more sets would: 100 to 250 bytes a point.
    static constexpr size_t kFewest = 256, kMost = 262'144, kSets = 4;

    // count: from kFewest to kMost.
    std::shared_ptr<const PreparedSet> find_or_prepare(
        const std::shared_ptr<const Template>& surface, const double* xyz, size_t count,
        const Services* helpers);

  private:
    struct Entry {
        std::shared_ptr<const std::vector<double>> xyz;
        std::shared_ptr<const PreparedSet> set;
    };
    std::mutex mutex_;
    std::vector<Entry> entries_;  // the last used come first
};

}  // namespace defrec
