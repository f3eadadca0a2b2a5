// Occlusion accuracy and Average Jaccard.
#include "sdk/evaluation/score/visibility.hpp"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>

#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using Json = nlohmann::ordered_json;

double share(std::size_t part, std::size_t whole) {
    return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole)
                     : std::numeric_limits<double>::quiet_NaN();
}

Jaccard jaccard_of(const std::vector<VisibilitySample>& samples,
                   double VisibilitySample::*distance) {
    Jaccard jaccard;
    for (std::size_t i = 0; i < kJaccardDistances.size(); ++i) {
        std::size_t true_positive = 0, false_positive = 0, false_negative = 0;
        for (const VisibilitySample& sample : samples) {
            const bool within = sample.*distance <= kJaccardDistances[i];
            const bool hit = sample.truly_visible && sample.said_visible && within;
            true_positive += hit ? 1 : 0;
            false_positive += sample.said_visible && !hit ? 1 : 0;
            false_negative += sample.truly_visible && !hit ? 1 : 0;
        }
        jaccard.at[i] = share(true_positive, true_positive + false_positive + false_negative);
    }
    jaccard.average = std::accumulate(jaccard.at.begin(), jaccard.at.end(), 0.0) /
                      static_cast<double>(jaccard.at.size());
    return jaccard;
}

Json jaccard_json(const Jaccard& jaccard) {
    Json json;
    json["average"] = jaccard.average;
    for (std::size_t i = 0; i < kJaccardDistances.size(); ++i)
        json[format_fixed(kJaccardDistances[i], 0)] = jaccard.at[i];
    return json;
}

}  // namespace

Visibility visibility_of(const std::vector<VisibilitySample>& samples, bool with_pixels) {
    const auto right = std::count_if(
        samples.begin(), samples.end(),
        [](const VisibilitySample& sample) { return sample.truly_visible == sample.said_visible; });
    Visibility visibility;
    visibility.count = samples.size();
    visibility.occlusion_accuracy = share(static_cast<std::size_t>(right), samples.size());
    visibility.mm = jaccard_of(samples, &VisibilitySample::distance_mm);
    if (with_pixels) visibility.px = jaccard_of(samples, &VisibilitySample::distance_px);
    return visibility;
}

Json visibility_json(const Visibility& visibility) {
    Json json;
    json["count"] = visibility.count;
    json["occlusion_accuracy"] = visibility.occlusion_accuracy;
    json["jaccard_mm"] = jaccard_json(visibility.mm);
    json["jaccard_px"] = visibility.px ? jaccard_json(*visibility.px) : Json(nullptr);
    return json;
}

}  // namespace defrec::cli
