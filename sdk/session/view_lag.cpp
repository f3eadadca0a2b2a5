// See view_lag.hpp.
#include "sdk/session/view_lag.hpp"

#include <cmath>

#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/sentence.hpp"
#include "sdk/io/statistics.hpp"
#include "sdk/session/decisions.hpp"

namespace defrec::cli {

void ViewLag::add(const defrec_result& result, bool is_one_view_still) {
    ++frames_;
    if (is_one_view_still || (result.reasons & DEFREC_REASON_VIEW_LATE) == 0) return;
    ++told_;
    if (result.view_lag_frames != 0) lags_.push_back(result.view_lag_frames);
}

bool ViewLag::is_lasting(int drifted) const {
    const auto late = static_cast<double>(lags_.size());
    return late > 0 && late >= decisions::DoctorViews::kLateShare * frames_ &&
           late >= decisions::LastingViewLag::kShareOfDrifted * drifted;
}

bool ViewLag::is_in_most() const { return 2 * lags_.size() > static_cast<std::size_t>(frames_); }

std::string ViewLag::note(int drifted) const {
    if (told_ == 0) return {};
    if (!is_lasting(drifted))
        return "In some frames left and right view were taken at different times; see "
               "view_lag_frames in frames.csv.";
    const double lag = nearest_rank(lags_, 0.5);
    return "In " + of_frames(lags_.size(), static_cast<std::size_t>(frames_)) +
           " left and right view were taken at different times: the right view is " +
           format_fixed(std::abs(lag), 1) + " frames " + (lag > 0 ? "late" : "early") +
           " (median). Mend that first; defrec doctor, with the same images and calibration, says "
           "how. Rows of the two views differ by that as well, and tell only then whether the "
           "calibration is right. See view_lag_frames in frames.csv.";
}

}  // namespace defrec::cli
