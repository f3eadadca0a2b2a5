// Which share of the left view the right one sees.
#include <algorithm>
#include <cmath>

#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"
#include "sdk/io/statistics.hpp"

namespace defrec::cli {

Finding look_at_overlap(const Evidence& evidence) {
    Look look("overlap", "overlap", Severity::kWarning);
    if (evidence.matches.size() < decisions::DoctorMatches::kMinMatches)
        return look.unknown("too little is recognised in both views");
    std::vector<double> across, down;
    for (const ViewMatch& match : evidence.matches) {
        across.push_back(match.right.x - match.left.x);
        down.push_back(match.right.y - match.left.y);
    }
    const double share = std::max(0.0, 1 - std::abs(nearest_rank(across, 0.5)) / evidence.width) *
                         std::max(0.0, 1 - std::abs(nearest_rank(down, 0.5)) / evidence.height);
    look.measured(100 * share, "%");
    const std::string seen = "the right view sees " + percent(share) + " of what the left one sees";
    if (share >= decisions::DoctorViews::kMinOverlap) return look.fine(seen);
    return look.found("only part of the tissue has depth: " + seen + ".",
                      "Move farther from the tissue, let the views converge on it, or do not crop "
                      "the images.");
}

}  // namespace defrec::cli
