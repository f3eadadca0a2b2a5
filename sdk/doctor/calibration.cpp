// Whether the calibration is taken at all.
#include "sdk/doctor/findings.hpp"

namespace defrec::cli {

Finding look_at_calibration(const Evidence& evidence) {
    Look look("calibration", "calibration", Severity::kError);
    if (evidence.refusal.empty()) return look.fine("its numbers are possible");
    return look.found("the calibration is refused. " + evidence.refusal,
                      "Correct the number that is named, or calibrate anew.");
}

}  // namespace defrec::cli
