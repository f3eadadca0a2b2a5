// The errors of a sample in a few numbers.
#include "sdk/evaluation/score/error_summary.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "sdk/evaluation/score/percentile.hpp"

namespace defrec::cli {

ErrorSummary summarise(std::vector<double> errors) {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    if (errors.empty()) return {0, kNone, kNone, kNone, kNone, kNone};
    std::sort(errors.begin(), errors.end());
    double sum = 0, squares = 0;
    for (const double error : errors) {
        sum += error;
        squares += error * error;
    }
    const auto count = static_cast<double>(errors.size());
    return {errors.size(),
            percentile(errors, 0.5),
            sum / count,
            std::sqrt(squares / count),
            percentile(errors, 0.95),
            errors.back()};
}

nlohmann::ordered_json errors_json(const ErrorSummary& summary) {
    using Json = nlohmann::ordered_json;
    Json json;
    json["count"] = summary.count;
    const auto number = [&](double value) {
        return summary.count > 0 ? Json(value) : Json(nullptr);
    };
    json["median_mm"] = number(summary.median);
    json["mean_mm"] = number(summary.mean);
    json["rmse_mm"] = number(summary.rmse);
    json["p95_mm"] = number(summary.p95);
    json["max_mm"] = number(summary.max);
    return json;
}

}  // namespace defrec::cli
