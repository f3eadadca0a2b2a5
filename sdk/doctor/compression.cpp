// Whether compression shows: blocks of 8 px whose borders stand out, or blocks that are copies of
// the frame before.
#include <algorithm>
#include <array>
#include <cstdlib>

#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"
#include "sdk/input/compression/decisions.hpp"

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

bool are_copied(const Evidence& evidence) {
    return evidence.copied && *evidence.copied > decisions::CompressedVideo::kMostCopied;
}

// A calibration that does not fit the views costs depth as well; images without matches do not
// tell.
std::string sentence(const Evidence& evidence, const std::string& seen) {
    const double without_depth = evidence.probe.share_without_depth();
    const bool may_fit = evidence.probe.has_rig && (!evidence.has_trials() || evidence.has_depth());
    if (!may_fit || without_depth < decisions::CompressedVideo::kMostWithoutDepth)
        return "the video is strongly compressed: " + seen + ".";
    return "the video is compressed beyond use, there is no depth in " + percent(without_depth) +
           " of the surface: " + seen + ".";
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
    std::string seen;
    if (worst > decisions::DoctorImages::kBlockRatio) {
        look.measured(worst, "");
        seen = "gray levels change " + format_fixed(worst, 2) +
               " times as much from one block of 8 px to the next as within blocks";
    } else if (are_copied(evidence)) {
        look.measured(100 * *evidence.copied, "%");
        seen = format_fixed(100 * *evidence.copied, 1) +
               " % of the blocks of 16 px are copies of the frame before, which a camera never "
               "gives";
    } else {
        return look.measured(worst, "").fine(
            evidence.copied ? "no blocks stand out, by their borders or as copies"
                            : "no blocks stand out by their borders; too little texture tells of "
                              "copies");
    }
    return look.found(sentence(evidence, seen),
                      "Record at a higher rate or quality, or without loss: by `defrec record` "
                      "without --format h264, by FFmpeg with -crf 17 or less.");
}

}  // namespace defrec::cli
