// See template_trial.hpp.
#include "sdk/tracking/monitors/template_trial.hpp"

#include <algorithm>

#include "sdk/tracking/decisions/states.hpp"

namespace defrec {

void TemplateTrial::begin(uint32_t features, uint32_t least) {
    *this = {};
    is_on_ = true;
    features_ = features;
    least_ = std::max(least, decisions::TemplateTrial::kMinFeatures);
}

bool TemplateTrial::add_frame(bool is_found, uint32_t features) {
    using decisions::TemplateTrial;
    if (!is_on_) return false;
    const auto shows = [&](double share) {
        return features >= least_ && features >= share * features_;
    };
    const bool shows_more = shows(TemplateTrial::kRicher);
    if (is_found) {
        was_found_ = true;
        lost_ = 0;
        found_ += shows_more;
        is_on_ = found_ < TemplateTrial::kFoundFrames;
        return false;
    }
    if (shows_more || (!was_found_ && shows(TemplateTrial::kAsRich))) ++lost_;
    if (lost_ < TemplateTrial::kLostFrames) return false;
    is_on_ = false;
    return true;
}

}  // namespace defrec
