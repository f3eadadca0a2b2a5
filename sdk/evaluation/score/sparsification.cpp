// Sparsification curves and the area between them.
#include "sdk/evaluation/score/sparsification.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace defrec::cli {
namespace {

// The curve of errors in the order in which they stay: the last is removed first.
std::vector<double> curve_of(const std::vector<double>& errors) {
    std::vector<double> means(errors.size());
    double sum = 0;
    for (std::size_t i = 0; i < errors.size(); ++i) {
        sum += errors[i];
        means[errors.size() - 1 - i] = sum / static_cast<double>(i + 1);
    }
    const double all = means.empty() ? 0 : means.front();
    for (double& mean : means) mean = all > 0 ? mean / all : 0;
    return means;
}

// Replaces the errors of samples with the same expected error by their mean.
std::vector<double> errors_by_expected(const std::vector<ErrorSample>& ascending) {
    std::vector<double> errors;
    errors.reserve(ascending.size());
    for (auto first = ascending.begin(); first != ascending.end();) {
        double sum = 0;
        auto last = first;
        for (; last != ascending.end() && last->expected_mm == first->expected_mm; ++last)
            sum += last->error_mm;
        const auto count = static_cast<std::size_t>(last - first);
        errors.insert(errors.end(), count, sum / static_cast<double>(count));
        first = last;
    }
    return errors;
}

}  // namespace

Sparsification sparsification_of(const std::vector<ErrorSample>& samples) {
    std::vector<ErrorSample> ascending;
    std::copy_if(samples.begin(), samples.end(), std::back_inserter(ascending),
                 [](const ErrorSample& sample) { return !std::isnan(sample.expected_mm); });
    std::sort(ascending.begin(), ascending.end(), [](const ErrorSample& a, const ErrorSample& b) {
        return a.expected_mm < b.expected_mm;
    });
    std::vector<double> errors = errors_by_expected(ascending);
    Sparsification curves;
    curves.by_expected = curve_of(errors);
    for (std::size_t i = 0; i < errors.size(); ++i) errors[i] = ascending[i].error_mm;
    std::sort(errors.begin(), errors.end());
    curves.by_true = curve_of(errors);
    return curves;
}

double ause_of(const Sparsification& curves) {
    if (curves.by_true.empty()) return std::numeric_limits<double>::quiet_NaN();
    double sum = 0;
    for (std::size_t i = 0; i < curves.by_true.size(); ++i)
        sum += curves.by_expected[i] - curves.by_true[i];
    return sum / static_cast<double>(curves.by_true.size());
}

}  // namespace defrec::cli
