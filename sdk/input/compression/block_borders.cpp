// See block_borders.hpp.
#include "sdk/input/compression/block_borders.hpp"

#include <algorithm>
#include <cstdlib>

namespace defrec::cli {

using decisions::BlockBorder;

void BlockBorders::add(const cv::Mat& gray) {
    add_differences(gray, along_rows_);
    add_differences(gray.t(), along_columns_);
}

double BlockBorders::ratio() const {
    return std::max(ratio_of(along_rows_), ratio_of(along_columns_));
}

void BlockBorders::add_differences(const cv::Mat& gray, Phases& phases) {
    constexpr int kMost = BlockBorder::kMaxStep;
    for (int y = 0; y < gray.rows; ++y) {
        const auto* row = gray.ptr<std::uint8_t>(y);
        for (int x = 1; x < gray.cols; ++x) {
            if (std::min(row[x], row[x - 1]) < BlockBorder::kMinGray) continue;
            Phase& phase = phases[static_cast<std::size_t>(x % BlockBorder::kSide)];
            phase.sum += std::min(std::abs(row[x] - row[x - 1]), kMost);
            ++phase.count;
        }
    }
}

double BlockBorders::ratio_of(const Phases& phases) {
    std::array<double, BlockBorder::kSide> means{};
    for (std::size_t i = 0; i < means.size(); ++i)
        means[i] = phases[i].sum / std::max(phases[i].count, 1.0);
    std::sort(means.begin(), means.end());
    constexpr std::size_t kMiddle = BlockBorder::kSide / 2;
    const double median = 0.5 * (means[kMiddle - 1] + means[kMiddle]);
    return median > 0 ? means.back() / median : 1;
}

}  // namespace defrec::cli
