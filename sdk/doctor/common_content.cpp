// Whether the right view shows what the left one shows.
#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"

namespace defrec::cli {

Finding look_at_common_content(const Evidence& evidence) {
    Look look("common_content", "common content", Severity::kError);
    const std::size_t count = evidence.matches.size();
    look.measured(static_cast<double>(count), "places");
    const std::string seen = std::to_string(count) + (count == 1 ? " place was" : " places were") +
                             " recognised in both views";
    if (count >= decisions::DoctorMatches::kMinMatches) return look.fine(seen);
    return look.found(
        "the views hardly show the same: only " + seen + " of " +
            std::to_string(evidence.pairs.size()) + " frames.",
        "Check that both recordings are of one time and of one pair of cameras, that no view is "
        "turned, mirrored or out of focus, and that rows of the raw views differ by " +
            percent(decisions::DoctorMatches::kMaxRowShare) + " of the height at most.");
}

}  // namespace defrec::cli
