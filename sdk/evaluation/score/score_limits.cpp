// What a score is asked to keep within.
#include "sdk/evaluation/score/score_limits.hpp"

#include "sdk/io/text.hpp"

namespace defrec::cli {

std::vector<std::string> exceeded(const std::string& over, const ErrorSummary& errors,
                                  const ScoreLimits& limits) {
    std::vector<std::string> messages;
    const auto check = [&](const char* name, double value, std::optional<double> limit) {
        if (!limit || (errors.count > 0 && value <= *limit)) return;
        messages.push_back(std::string(name) + " over " + over + " is " +
                           (errors.count > 0 ? format_fixed(value, 3) + " mm"
                                             : std::string("not to be had, all are lost")) +
                           ", asked were at most " + format_fixed(*limit, 3) + " mm");
    };
    check("the median", errors.median, limits.max_median_mm);
    check("the 95th percentile", errors.p95, limits.max_p95_mm);
    return messages;
}

std::string joined(const std::vector<std::string>& messages) {
    std::string text;
    for (const std::string& message : messages) text += (text.empty() ? "" : "; ") + message;
    return text.empty() ? text : text + ".";
}

}  // namespace defrec::cli
