// See quality_level.hpp.
#include "sdk/tracking/frame/quality_level.hpp"

#include <algorithm>

#include "include/defrec_c.h"
#include "sdk/tracking/decisions/stages.hpp"

namespace defrec {
namespace {

using decisions::Deadlines;

}  // namespace

QualityLevel QualityLevelTimes::choose(Time left) const {
    for (size_t i = 0; i + 1 < kQualityLevels; ++i)
        if (left > Time::zero() && Deadlines::kMargin * expected_[i] <= left)
            return static_cast<QualityLevel>(i);
    return static_cast<QualityLevel>(kQualityLevels - 1);
}

// A device that is slower at one quality level is slower at all. A level that did not fit is tried
// again some day, as one frame may have been slow by itself, or the device is faster now; its time
// is then what it takes.
void QualityLevelTimes::add(QualityLevel quality_level, Time took) {
    const auto index = static_cast<size_t>(quality_level);
    const Time before = expected_[index];
    const bool is_mean = before > Time::zero() && !is_forgotten_[index];
    expected_[index] = is_mean ? before + Deadlines::kNewest * (took - before) : took;
    is_forgotten_[index] = false;
    for (size_t i = 0; i < kQualityLevels; ++i) {
        if (is_mean && i != index) expected_[i] *= expected_[index] / before;
        if (i < index) {
            expected_[i] *= 1 - Deadlines::kForgotten;
            is_forgotten_[i] = true;
        }
    }
}

uint32_t reasons_of(QualityLevel quality_level) {
    uint32_t reasons = 0;
    if (quality_level >= QualityLevel::kCoarse) reasons |= DEFREC_REASON_COARSE;
    if (quality_level >= QualityLevel::kUnchecked) reasons |= DEFREC_REASON_UNCHECKED;
    return reasons;
}

}  // namespace defrec
