// Whether expected errors hold.
#include "sdk/evaluation/score/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "sdk/evaluation/score/percentile.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::string percent(double share) { return format_fixed(100 * share, 2) + " %"; }

const char* name_of(Judgement judgement) {
    switch (judgement) {
        case Judgement::kTooSmall:
            return "too small";
        case Judgement::kHold:
            return "hold";
        case Judgement::kTooLarge:
            return "too large";
        case Judgement::kNotJudged:
            break;
    }
    return "not judged";
}

}  // namespace

std::vector<double> ratios_of(const std::vector<ErrorSample>& samples) {
    std::vector<double> ratios;
    ratios.reserve(samples.size());
    for (const auto& [error, expected] : samples) {
        if (!std::isnan(expected)) ratios.push_back(error == 0 ? 0 : error / expected);
    }
    std::sort(ratios.begin(), ratios.end());
    return ratios;
}

double share_within(const std::vector<double>& ascending_ratios, double k) {
    if (ascending_ratios.empty()) return kNone;
    const auto end = std::upper_bound(ascending_ratios.begin(), ascending_ratios.end(), k);
    return static_cast<double>(end - ascending_ratios.begin()) /
           static_cast<double>(ascending_ratios.size());
}

Coverage coverage_of(const std::vector<ErrorSample>& samples) {
    const std::vector<double> ratios = ratios_of(samples);
    Coverage coverage;
    coverage.count = ratios.size();
    coverage.without_expected = samples.size() - ratios.size();
    for (int k = 0; k < 3; ++k) coverage.within[k] = share_within(ratios, k + 1.0);
    double squares = 0;
    for (const double ratio : ratios) squares += ratio * ratio;
    coverage.rms_ratio = std::sqrt(squares / static_cast<double>(ratios.size()));
    coverage.p99_ratio = percentile(ratios, 0.99);
    return coverage;
}

Judgement judgement_of(const Coverage& coverage) {
    if (coverage.count < CoverageBands::kMinCount) return Judgement::kNotJudged;
    for (int k = 0; k < 3; ++k)
        if (coverage.within[k] < CoverageBands::kMinWithin[k]) return Judgement::kTooSmall;
    return coverage.within[0] > CoverageBands::kMaxWithinOne ? Judgement::kTooLarge
                                                             : Judgement::kHold;
}

namespace {

std::string within_text(const double (&within)[3]) {
    return percent(within[0]) + " are within 1, " + percent(within[1]) + " within 2 and " +
           percent(within[2]) + " within 3";
}

std::string least_text() {
    const auto& min = CoverageBands::kMinWithin;
    return "at least " + percent(min[0]) + ", " + percent(min[1]) + " and " + percent(min[2]);
}

}  // namespace

std::string judgement_lines(const std::vector<StatusConfidence>& statuses) {
    std::string too_small, too_large;
    for (const auto& [status, coverage, ause] : statuses) {
        const Judgement judgement = judgement_of(coverage);
        const std::string points = "expected errors of " + status + " points are too ";
        if (judgement == Judgement::kTooSmall)
            too_small += "WARNING. " + points + "small: " + within_text(coverage.within) +
                         " of them, and " + least_text() + " should be\n";
        if (judgement == Judgement::kTooLarge)
            too_large += points + "large, which is safe: " + percent(coverage.within[0]) +
                         " are within 1, more than " + percent(CoverageBands::kMaxWithinOne) + "\n";
    }
    return too_small + too_large;
}

std::vector<std::string> miscalibrated(const std::vector<StatusConfidence>& statuses) {
    std::vector<std::string> messages;
    bool any_judged = false;
    for (const auto& [status, coverage, ause] : statuses) {
        if (coverage.without_expected > 0) {
            messages.push_back(std::to_string(coverage.without_expected) + " " + status +
                               " points have no expected error");
        }
        const Judgement judgement = judgement_of(coverage);
        any_judged |= judgement != Judgement::kNotJudged;
        if (judgement != Judgement::kTooSmall) continue;
        messages.push_back("of the " + status + " points " + within_text(coverage.within) +
                           " expected errors, asked were " + least_text());
    }
    if (!any_judged) {
        messages.push_back("no status has " + std::to_string(CoverageBands::kMinCount) +
                           " points to judge its expected errors by");
    }
    return messages;
}

nlohmann::ordered_json coverage_json(const Coverage& coverage) {
    using Json = nlohmann::ordered_json;
    // nlohmann::json writes NaN and infinity as null.
    Json json;
    json["count"] = coverage.count;
    json["without_expected_error"] = coverage.without_expected;
    json["within_1"] = coverage.within[0];
    json["within_2"] = coverage.within[1];
    json["within_3"] = coverage.within[2];
    json["rms_ratio"] = coverage.rms_ratio;
    json["p99_ratio"] = coverage.p99_ratio;
    json["judgement"] = name_of(judgement_of(coverage));
    return json;
}

}  // namespace defrec::cli
