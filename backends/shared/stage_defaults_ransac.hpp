// Defaults of the stage ransac's parameters, and the limits of every backend.
#pragma once
#include <cmath>
#include <string>

#include "backends/shared/stage.hpp"

namespace defrec {

// threshold_mm stays 0 where it is not given: its default is derived from each run's points
// (docs/stages/ransac.md).
inline void fill_defaults(defrec_ransac_params& params) {
    if (params.references == 0) params.references = 30;
    if (params.iterations == 0) params.iterations = 10;
    if (params.min_support == 0) params.min_support = 6;
}

enum { kRansacMaxReferences = 1024, kRansacMaxIterations = 100 };

// Throws unless the parameters are complete and within the limits of docs/stages/ransac.md.
inline void check_limits(const defrec_ransac_params& params) {
    const auto refuse = [](const std::string& text) {
        throw StageError(DEFREC_ERROR_UNSUPPORTED, "ransac: " + text);
    };
    if (params.references < 1 || params.references > kRansacMaxReferences)
        refuse(std::to_string(params.references) + " references given, 1 to 1024 supported");
    if (params.iterations < 1 || params.iterations > kRansacMaxIterations)
        refuse(std::to_string(params.iterations) + " iterations given, 1 to 100 supported");
    if (!std::isfinite(params.threshold_mm) || params.threshold_mm < 0.0f)
        refuse("threshold_mm is negative or not finite");
}

}  // namespace defrec
