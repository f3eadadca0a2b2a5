// The errors of a sample in a few numbers.
#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <vector>

namespace defrec::cli {

// Statistics of distances, mm; NaN where count is 0. Percentiles interpolate linearly between the
// two nearest ranks.
struct ErrorSummary {
    std::size_t count = 0;
    double median = 0, mean = 0, rmse = 0, p95 = 0, max = 0;
};
ErrorSummary summarise(std::vector<double> errors);

nlohmann::ordered_json errors_json(const ErrorSummary& summary);

}  // namespace defrec::cli
