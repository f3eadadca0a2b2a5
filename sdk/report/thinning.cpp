// The plotted lines' merging.
#include "sdk/report/thinning.hpp"

#include <algorithm>
#include <limits>

namespace defrec::cli {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

float worst_of(Series::Worst worst, float a, float b) {
    if (std::isnan(a)) return b;
    if (std::isnan(b)) return a;
    return worst == Series::Worst::largest ? std::max(a, b) : std::min(a, b);
}

}  // namespace

std::size_t Series::line(const std::string& name, Worst worst) {
    for (std::size_t i = 0; i < lines_.size(); ++i)
        if (lines_[i].name == name) return i;
    lines_.push_back({name, worst, std::vector<float>(frames_.size(), kNan)});
    return lines_.size() - 1;
}

void Series::begin(std::int64_t frame, double timestamp_ms) {
    if (!frames_.empty() && in_last_ < stride_) {
        ++in_last_;
        return;
    }
    if (frames_.size() == capacity_) halve();
    frames_.push_back(frame);
    timestamps_ms_.push_back(timestamp_ms);
    for (Line& each : lines_) each.values.push_back(kNan);
    in_last_ = 1;
}

void Series::set(std::size_t line, double value) {
    float& last = lines_[line].values.back();
    last = worst_of(lines_[line].worst, last, static_cast<float>(value));
}

void Series::halve() {
    const std::size_t kept = (frames_.size() + 1) / 2;
    for (std::size_t i = 0; i < kept; ++i) {
        frames_[i] = frames_[2 * i];
        timestamps_ms_[i] = timestamps_ms_[2 * i];
        for (Line& each : lines_) {
            const float next = 2 * i + 1 < each.values.size() ? each.values[2 * i + 1] : kNan;
            each.values[i] = worst_of(each.worst, each.values[2 * i], next);
        }
    }
    frames_.resize(kept);
    timestamps_ms_.resize(kept);
    for (Line& each : lines_) each.values.resize(kept);
    stride_ *= 2;
}

}  // namespace defrec::cli
