// See disparity_check.hpp.
#include "sdk/tracking/monitors/disparity_check.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "sdk/base/util/median.hpp"
#include "sdk/tracking/decisions/disparity.hpp"

namespace defrec {
namespace {

using Decision = decisions::GivenDisparity;

// Mean of what is known round a pixel, px: noise that differs from pixel to pixel is no error of
// the whole.
std::optional<double> mean_around(const TemplateData& data, const int16_t* values, double u,
                                  double v) {
    const auto width = static_cast<int64_t>(data.width), height = static_cast<int64_t>(data.height);
    const int64_t x = std::llround(u), y = std::llround(v);
    double sum = 0;
    int count = 0;
    for (int64_t j = y - Decision::kRadius; j <= y + Decision::kRadius; ++j)
        for (int64_t i = x - Decision::kRadius; i <= x + Decision::kRadius; ++i) {
            if (i < 0 || j < 0 || i >= width || j >= height) continue;
            const int16_t value = values[j * width + i];
            if (value == DEFREC_DISPARITY_NONE) continue;
            sum += value;
            ++count;
        }
    if (count == 0) return std::nullopt;
    return sum / (count * double{DEFREC_DISPARITY_ONE});
}

}  // namespace

bool is_off(const KeptDisparity& kept, double px) {
    return px > std::max(Decision::kMinError, Decision::kSigmas * double{kept.sigma_px});
}

DisparityCheck check_disparity(const TemplateData& data, const FrameOutput& output,
                               const KeptDisparity& kept) {
    constexpr double kOne = 256;  // of an observation, per px
    const size_t step = rig_patch_step(data);
    std::vector<double> differences, seen, unfound;  // px; of the last the columns
    for (size_t i = 0; i < output.right_observations.size(); ++i) {
        const defrec_patch_observation &left = output.observations[i * step],
                                       &right = output.right_observations[i];
        if (left.valid != 1) continue;
        const std::optional<double> given =
            mean_around(data, kept.values, left.u / kOne, left.v / kOne);
        if (!given) continue;
        if (right.valid != 1) {
            unfound.push_back(left.u / kOne);
            continue;
        }
        seen.push_back((left.u - right.u) / kOne);
        differences.push_back(std::abs(seen.back() - *given));
    }
    const size_t in_both = differences.size(), in_left = in_both + unfound.size();
    if (in_left < Decision::kMinPatches) return {};
    // So far from where it is that the search there finds nothing.
    if (static_cast<double>(in_both) < Decision::kMinFound * static_cast<double>(in_left))
        return {true, Decision::kUnfoundError};
    // As far off, where the right view reaches so far.
    const bool is_by_unfound = !is_off(kept, median(differences));
    const double least_column = median(std::move(seen)) + Decision::kUnfoundError;
    for (const double column : unfound)
        if (column >= least_column) differences.push_back(double{Decision::kUnfoundError});
    const double middle = median(std::move(differences));
    if (!is_off(kept, middle)) return {};
    return {true,
            static_cast<float>(
                std::min(Decision::kDeviation * middle, double{Decision::kUnfoundError})),
            is_by_unfound};
}

}  // namespace defrec
