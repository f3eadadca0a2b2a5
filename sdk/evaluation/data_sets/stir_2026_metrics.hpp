// The metrics of STIR 2026.
#pragma once

#include <array>
#include <vector>

namespace defrec::cli {

struct VisiblePoint {
    bool is_visible = false, said_visible = false;
    double error = 0;  // distance of the prediction from the truth
};

// Jaccard and accuracy at 2, 4, 8, 16 and 32 (px or mm), then their means. Within is strictly
// less. Jaccard: TP / (TP + FP + FN), 0 where that is 0 / 0. Accuracy: the share of the visible
// points within, whatever was said of them; 0 where none is visible.
struct TrackingScores {
    std::array<double, 5> jaccard{}, accuracy{};
    double average_jaccard = 0, average_accuracy = 0;
    double occlusion_accuracy = 0;  // share of points whose visibility was said rightly
};
TrackingScores tracking_scores(const std::vector<VisiblePoint>& points);

}  // namespace defrec::cli
