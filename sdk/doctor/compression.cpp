// Whether compression shows: blocks of 8 px whose borders stand out.
#include <algorithm>
#include <array>
#include <cstdlib>

#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"

namespace defrec::cli {
namespace {

constexpr int kBlock = 8;
using Phases = std::array<double, kBlock>;

// Adds differences of neighbours along rows, by the column at which they stand.
void add_differences(const cv::Mat& gray, Phases& sums) {
    constexpr int kMost = decisions::DoctorImages::kMaxStep;
    for (int y = 0; y < gray.rows; ++y) {
        const auto* row = gray.ptr<std::uint8_t>(y);
        for (int x = 1; x < gray.cols; ++x)
            sums[static_cast<std::size_t>(x % kBlock)] +=
                std::min(std::abs(row[x] - row[x - 1]), kMost);
    }
}

double block_ratio(const Phases& sums) {
    Phases sorted = sums;
    std::sort(sorted.begin(), sorted.end());
    const double median = 0.5 * (sorted[kBlock / 2 - 1] + sorted[kBlock / 2]);
    return median > 0 ? sorted.back() / median : 1;
}

}  // namespace

Finding look_at_compression(const Evidence& evidence) {
    Look look("compression", "compression", Severity::kWarning);
    double worst = 0;
    for (const auto view : {&GrayPair::left, &GrayPair::right}) {
        Phases along_rows{}, along_columns{};
        for (const GrayPair& pair : evidence.pairs) {
            add_differences(pair.*view, along_rows);
            add_differences((pair.*view).t(), along_columns);
        }
        worst = std::max({worst, block_ratio(along_rows), block_ratio(along_columns)});
    }
    look.measured(worst, "");
    if (worst <= decisions::DoctorImages::kBlockRatio) return look.fine("no blocks stand out");
    return look.found("the video is strongly compressed: gray levels change " +
                          format_fixed(worst, 2) +
                          " times as much from one block of 8 px to the next "
                          "as within blocks.",
                      "Record at a higher rate or quality, or without loss; with FFmpeg, -crf 17 "
                      "or less.");
}

}  // namespace defrec::cli
