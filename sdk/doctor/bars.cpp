// Whether the picture lies between black bars, as one of another shape does.
#include <algorithm>
#include <opencv2/core.hpp>

#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"

namespace defrec::cli {
namespace {

using Decision = decisions::DoctorBars;

// The place of most of those given, but for a pixel; -1 where they are not in one place.
int common_place(const std::vector<int>& places, int size) {
    std::vector<int> counts(static_cast<std::size_t>(size) + 2, 0);
    for (const int place : places) ++counts[static_cast<std::size_t>(place) + 1];
    int best = -1, most = 0;
    for (int place = 0; place < size; ++place) {
        const auto at = static_cast<std::size_t>(place) + 1;
        const int near = counts[at - 1] + counts[at] + counts[at + 1];
        if (near > most) {
            most = near;
            best = place;
        }
    }
    return most >= Decision::kStraight * static_cast<double>(places.size()) ? best : -1;
}

// Share of the width that straight bars at its left and right cover; 0 where there are none.
double bars_at_sides(const cv::Mat& is_lit) {
    std::vector<int> first, last;
    for (int y = 0; y < is_lit.rows; ++y) {
        const auto* row = is_lit.ptr<std::uint8_t>(y);
        const auto* const begin = std::find_if(row, row + is_lit.cols, [](int lit) { return lit; });
        if (begin == row + is_lit.cols) continue;
        int end = is_lit.cols - 1;
        while (row[end] == 0) --end;
        first.push_back(static_cast<int>(begin - row));
        last.push_back(is_lit.cols - 1 - end);
    }
    if (static_cast<double>(first.size()) < Decision::kMinLines * is_lit.rows) return 0;
    const int least = std::min(common_place(first, is_lit.cols), common_place(last, is_lit.cols));
    return least >= Decision::kLeast * is_lit.cols ? 2.0 * least / is_lit.cols : 0;
}

struct Bars {
    double sides = 0, ends = 0;  // share of the width, of the height
};

Bars bars_of(const Evidence& evidence, cv::Mat GrayPair::*view) {
    cv::Mat brightest = (evidence.pairs.front().*view).clone();  // tissue may be dark in a frame
    for (const GrayPair& pair : evidence.pairs) brightest = cv::max(brightest, pair.*view);
    const cv::Mat is_lit = brightest > Decision::kBorder;
    return {bars_at_sides(is_lit), bars_at_sides(is_lit.t())};
}

}  // namespace

Finding look_at_bars(const Evidence& evidence) {
    Look look("bars", "black bars", Severity::kWarning);
    const Bars left = bars_of(evidence, &GrayPair::left),
               right = bars_of(evidence, &GrayPair::right);
    const double sides = std::min(left.sides, right.sides), ends = std::min(left.ends, right.ends);
    if (sides == 0 && ends == 0)
        return look.measured(0, "%").fine("the picture lies between no straight bars");
    const double share = std::max(sides, ends);
    return look.measured(100 * share, "%")
        .found(std::string("the picture lies between black bars ") +
                   (sides > 0 ? "at its sides" : "above and below") + ", which cover " +
                   percent(share) + " of the " + (sides > 0 ? "width" : "height") +
                   ": a calibration of pictures without them is wrong for it, and nothing shows "
                   "that.",
               "Record the picture without bars, or calibrate with images that have the same "
               "bars; if that was done, nothing is wrong.");
}

}  // namespace defrec::cli
