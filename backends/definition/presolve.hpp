// The rigid motion that brings deformed landmarks onto their matches, found before stage lm
// iterates (docs/stages/lm.md).
#pragma once
#include "backends/definition/lm_inputs.hpp"
#include "backends/shared/levenberg_marquardt.hpp"
#include "backends/shared/lm_terms.hpp"
#include "backends/shared/rigid_fit.hpp"
#include "backends/stages/lm.hpp"

namespace defrec {

// deformed: where each landmark with a preselected match is by the present motions; only those
// count. squared_errors: room for as many. The identity where they are too few, or where no rigid
// motion brings them closer by Tukey's measure.
inline DualQuaternion<double> presolve(const Host& host, const defrec_match* matches,
                                       std::span<const Vec3<double>> deformed, double tukey_mm,
                                       std::span<double> squared_errors) {
    const auto identity = DualQuaternion<double>::identity();
    int32_t count = 0;
    for (size_t i = 0; i < deformed.size(); ++i) count += preselected(matches[i]) ? 1 : 0;
    if (count < kPresolveMinMatches) return identity;

    const auto measure = [&](const DualQuaternion<double>& motion) {
        for_each_item(host, deformed.size(), [&](size_t i) {
            if (!preselected(matches[i])) return;
            const Vec3<double> error =
                apply(motion, deformed[i]) - load3<double>(matches[i].position);
            squared_errors[i] = dot(error, error);
        });
    };
    const auto cost = [&] {
        double sum = 0;
        for (size_t i = 0; i < deformed.size(); ++i)
            if (preselected(matches[i]))
                sum += double(matches[i].weight) *
                       tukey(squared_errors[i], 1 / (tukey_mm * tukey_mm)).cost;
        return sum;
    };
    measure(identity);
    const double cost_at_rest = cost();
    DualQuaternion<double> motion = identity;
    double squares_before = 0;
    for (int round = 0; round < kPresolveRounds; ++round) {
        double weights = 0, squares = 0;
        for (size_t i = 0; i < deformed.size(); ++i)
            if (preselected(matches[i])) {
                weights += double(matches[i].weight);
                squares += double(matches[i].weight) * squared_errors[i];
            }
        if (round > 0 &&
            std::abs(squares - squares_before) <= double(kPresolveMinChange) * squares_before)
            break;
        squares_before = squares;
        const double c2 = std::max(tukey_mm * tukey_mm, kPresolveMinWidth2 * squares / weights);
        RigidFit fit;
        for (size_t i = 0; i < deformed.size(); ++i)
            if (preselected(matches[i]))
                fit.add(double(matches[i].weight) * tukey(squared_errors[i], 1 / c2).weight,
                        deformed[i], load3<double>(matches[i].position));
        motion = fit.solve();
        measure(motion);
    }
    return cost() < cost_at_rest ? motion : identity;
}

}  // namespace defrec
