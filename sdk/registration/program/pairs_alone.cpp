// See pairs_alone.hpp. One wrong pair is told by how much the sum of squares falls without it: by
// chi squared, or by Fisher's F where errors come from the residuals, times the number of pairs
// (Bonferroni). Both have a closed form for an even number of squares.
#include "sdk/registration/program/pairs_alone.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sdk/registration/program/decisions.hpp"

namespace defrec::cli {
namespace {

using decisions::PairsWithSurface;

bool is_stated(const PairsFile& pairs) {
    const auto is_error = [](double value) { return value != 0; };
    return std::any_of(pairs.seen_covariance.begin(), pairs.seen_covariance.end(), is_error) ||
           std::any_of(pairs.model_covariance.begin(), pairs.model_covariance.end(), is_error);
}

double freedom_of(std::size_t pairs) { return 3 * static_cast<double>(pairs) - 6; }

// Sum of the squared residuals, in units of errors that are stated.
double squares_of(const Registered& by_pairs) {
    const double ratio = by_pairs.info.error_ratio;
    return ratio * ratio * 3 * static_cast<double>(by_pairs.info.used);
}

struct WrongPair {
    std::size_t index = 0;
    Registered rest;  // by the others
};

std::optional<WrongPair> wrong_pair(const PairsFile& pairs, const Registered& by_all,
                                    const RegisterOptions& options) {
    const std::size_t count = pairs.ids.size();
    if (count < PairsWithSurface::kMinPairs || count > PairsWithSurface::kMaxPairs) return {};
    WrongPair wrong;
    double least = std::numeric_limits<double>::infinity(), next = least;
    for (std::size_t i = 0; i < count; ++i) {
        std::vector<std::uint8_t> counts(count, 1);
        counts[i] = 0;
        Registered rest = register_by_pairs(pairs.those(counts), options);
        const double squares = squares_of(rest);
        next = std::min(next, std::max(least, squares));
        if (squares >= least) continue;
        least = squares;
        wrong = {i, std::move(rest)};
    }
    if (!wrong.rest.is_accepted()) return {};
    std::optional<double> freedom;
    double variance = 1;
    if (!is_stated(pairs)) {
        freedom = freedom_of(count - 1);
        variance = std::max(least / *freedom, PairsWithSurface::kMinVariance);
    }
    // Three squares count as four, which is on the safe side.
    const double of_all = chance_of((squares_of(by_all) - least) / variance, 2, freedom),
                 of_next = chance_of((next - least) / variance, 2, freedom);
    if (of_all * static_cast<double>(count) > PairsWithSurface::kChance ||
        of_next > PairsWithSurface::kChance)
        return {};
    return wrong;
}

}  // namespace

double chance_of(double sum, int half_count, const std::optional<double>& freedom) {
    const double a = freedom.value_or(0) / 2;
    const double x = freedom ? *freedom / (*freedom + sum) : 0, y = freedom ? 1 - x : sum / 2;
    double term = 1, terms = 1;
    for (int k = 1; k < half_count; ++k) {
        term *= y / k * (freedom ? a + k - 1 : 1);
        terms += term;
    }
    return terms * (freedom ? std::pow(x, a) : std::exp(-sum / 2));
}

PairsFile PairsEvidence::counted() const { return all.those(counts); }

PairsEvidence evidence_of(const PairsFile& pairs, const RegisterOptions& options) {
    PairsEvidence made;
    made.all = pairs;
    made.counts.assign(pairs.ids.size(), 1);
    made.alone = register_by_pairs(pairs, options);
    if (std::optional<WrongPair> wrong = wrong_pair(pairs, made.alone, options)) {
        made.counts[wrong->index] = 0;
        made.alone = std::move(wrong->rest);
    }
    const double freedom = freedom_of(static_cast<std::size_t>(made.alone.info.used));
    const double squares = squares_of(made.alone);
    if (is_stated(pairs)) {
        // As the library does with residuals that are larger than stated errors explain.
        const double factor = std::max(1.0, squares / freedom);
        for (std::vector<double>* errors : {&made.all.seen_covariance, &made.all.model_covariance})
            for (double& value : *errors) value *= factor;
        return made;
    }
    made.freedom = freedom;
    const double variance = std::max(squares / (freedom - 2), PairsWithSurface::kMinVariance);
    for (std::size_t i = 0; i < pairs.ids.size(); ++i)
        for (const std::size_t diagonal : {0, 3, 5})
            made.all.seen_covariance[6 * i + diagonal] = variance;
    return made;
}

}  // namespace defrec::cli
