// Points of a plan that are moved in many frames: defrec_targets_create().
#pragma once
#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

#include "sdk/tracking/points/prepared_set.hpp"

namespace defrec {

class Services;

// Any thread.
class PreparedTargets {
  public:
    static constexpr size_t kMaxTargets = 1000000;
    // template_xyz: three each. Throws Error(DEFREC_ERROR_ARGUMENT) for more than kMaxTargets.
    PreparedTargets(std::shared_ptr<const Template> surface, const double* template_xyz,
                    size_t count);

    size_t count() const { return xyz_.size() / 3; }
    const Template& surface() const { return *surface_; }
    // For frames with that template, and the body that it has now: kept until one of them changes.
    // helpers: whose threads take part; may be null.
    std::shared_ptr<const PreparedSet> prepared(const std::shared_ptr<const Template>& surface,
                                                const Services* helpers) const;

  private:
    const std::shared_ptr<const Template> surface_;
    const std::vector<double> xyz_;
    mutable std::mutex mutex_;
    mutable std::shared_ptr<const PreparedSet> last_;
};

}  // namespace defrec
