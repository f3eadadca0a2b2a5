// Whether expected errors hold: how often the true error lies within them.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace defrec::cli {

// A point with a position.
struct ErrorSample {
    double error_mm = 0;     // distance from the truth
    double expected_mm = 0;  // root mean square that was stated; NaN where none was
};

// The more certain status first.
using SamplesByStatus = std::map<std::string, std::vector<ErrorSample>, std::greater<>>;

// Error / expected error of the samples that have one, ascending; 0 where both are 0.
std::vector<double> ratios_of(const std::vector<ErrorSample>& samples);
// The share of them, 0..1, that are at most k; NaN for none.
double share_within(const std::vector<double>& ascending_ratios, double k);

// Statistics of the ratio error / expected error. Shares are 0..1. NaN where count is 0.
struct Coverage {
    std::size_t count = 0;             // samples with an expected error
    std::size_t without_expected = 0;  // the others, which nothing else here counts
    double within[3] = {};             // share within 1, 2 and 3 expected errors
    double rms_ratio = 0;              // 1 for an unbiased statement
    double p99_ratio = 0;
};
Coverage coverage_of(const std::vector<ErrorSample>& samples);

// An expected error is too small with less within 1, 2 and 3 of it, and too large with more within
// 1. A status with fewer points is not judged.
struct CoverageBands {
    static constexpr double kMinWithin[3] = {0.55, 0.93, 0.985};
    static constexpr double kMaxWithinOne = 0.85;
    static constexpr std::size_t kMinCount = 100;
};

struct StatusConfidence {
    std::string status;  // as points.csv names it, or "all"
    Coverage coverage;
    double ause = 0;  // area under the sparsification error curve
};

enum class Judgement { kNotJudged, kTooSmall, kHold, kTooLarge };

// Errors that are too small are unsafe, so shares that are too low come first.
Judgement judgement_of(const Coverage& coverage);

// One error message for each status whose expected errors are too small, or that has points without
// one, and one if no status can be judged. Empty when all hold or are too large.
std::vector<std::string> miscalibrated(const std::vector<StatusConfidence>& statuses);

// A line for each status whose expected errors are too small, then for those with too large ones;
// empty for none.
std::string judgement_lines(const std::vector<StatusConfidence>& statuses);

nlohmann::ordered_json coverage_json(const Coverage& coverage);

}  // namespace defrec::cli
