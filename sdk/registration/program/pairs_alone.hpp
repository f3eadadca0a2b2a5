// The pairs of a file as evidence beside a surface: their errors, and which of them is wrong.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "sdk/registration/program/register_calls.hpp"

namespace defrec::cli {

struct PairsEvidence {
    // With errors that hold their residuals, also where the file states none.
    PairsFile all;
    std::vector<std::uint8_t> counts;  // 0: contradicts the others and is left out
    Registered alone;                  // by those that count
    // Degrees of freedom of the residuals that errors come from which were not stated.
    std::optional<double> freedom;

    PairsFile counted() const;
};

// A pair is left out where the others agree without it, and with it they do not, and where that
// holds of no other pair.
PairsEvidence evidence_of(const PairsFile& pairs, const RegisterOptions& options);

// How probable it is that a sum of so many squares of normal errors, times two, is larger by
// chance; their variance is known to be 1, or was estimated with so many degrees of freedom.
double chance_of(double sum, int half_count, const std::optional<double>& freedom);

}  // namespace defrec::cli
