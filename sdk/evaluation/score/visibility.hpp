// Whether the points that can be seen are those that are said to be seen, and are where they are
// said to be: occlusion accuracy and Average Jaccard of TAP-Vid (Doersch et al. 2022).
#pragma once

#include <array>
#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

namespace defrec::cli {

struct VisibilitySample {
    bool truly_visible = false, said_visible = false;
    // From the truth; infinite for points without a position.
    double distance_mm = 0, distance_px = 0;
};

// In mm or px.
inline constexpr std::array<double, 5> kJaccardDistances{2, 4, 8, 16, 32};

// At distance d: TP / (TP + FP + FN). TP: visible, said to be visible and within d. FP: said to be
// visible, and hidden or farther than d. FN: visible, and said to be hidden or farther than d.
// NaN where TP + FP + FN is 0.
struct Jaccard {
    std::array<double, kJaccardDistances.size()> at{};
    double average = 0;
};

struct Visibility {
    std::size_t count = 0;
    double occlusion_accuracy = 0;  // share of samples that are visible as said; NaN for none
    Jaccard mm;
    std::optional<Jaccard> px;  // only with pixels
};
Visibility visibility_of(const std::vector<VisibilitySample>& samples, bool with_pixels);

nlohmann::ordered_json visibility_json(const Visibility& visibility);

}  // namespace defrec::cli
