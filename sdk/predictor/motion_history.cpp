// See motion_history.hpp.
#include "sdk/predictor/motion_history.hpp"

#include <algorithm>
#include <utility>

#include "sdk/predictor/decisions.hpp"

namespace defrec {

std::array<double, 4> lagrange_weights(const double* times, std::size_t count, double time) {
    std::array<double, 4> weights{};
    for (std::size_t i = 0; i < count; ++i) {
        double weight = 1;
        for (std::size_t j = 0; j < count; ++j)
            if (j != i) weight *= (time - times[j]) / (times[i] - times[j]);
        weights[i] = weight;
    }
    return weights;
}

void MotionHistory::grow() {
    std::vector<MotionFrame> larger(std::max<std::size_t>(2 * frames_.size(), 1));
    for (std::uint64_t number = next_ - size_; number != next_; ++number)
        larger[number % larger.size()] = std::move(frames_[slot(number)]);
    frames_ = std::move(larger);
}

MotionFrame& MotionHistory::add(double time_s, std::size_t points) {
    if (size_ == decisions::PredictionGrid::kMaxFrames) --size_;
    if (size_ == frames_.size()) grow();
    MotionFrame& frame = frames_[slot(next_)];
    frame.xyz.resize(3, static_cast<Eigen::Index>(points));
    frame.time_s = time_s;
    frame.lags.clear();
    ++next_;
    ++size_;
    return frame;
}

void MotionHistory::forget_before(std::uint64_t number) {
    if (number > oldest()) size_ = next_ - number;
}

std::uint64_t MotionHistory::last_before(double time_s) const {
    std::uint64_t low = oldest(), high = newest();
    while (low < high) {
        const std::uint64_t middle = low + (high - low + 1) / 2;
        if (at(middle).time_s <= time_s)
            low = middle;
        else
            high = middle - 1;
    }
    return low;
}

Taps MotionHistory::taps(double time_s, double same_s) const {
    if (is_empty() || time_s < at(oldest()).time_s - same_s) return {};
    const std::uint64_t before = last_before(time_s + same_s);
    if (before == newest() || time_s - at(before).time_s <= same_s) return {before, 1, {1}};
    Taps taps;
    taps.first = before == oldest() ? before : before - 1;
    taps.count = std::min<std::uint64_t>(before + 2, newest()) - taps.first + 1;
    std::array<double, 4> times{};
    for (std::size_t i = 0; i < taps.count; ++i) times[i] = at(taps.first + i).time_s;
    taps.weights = lagrange_weights(times.data(), taps.count, time_s);
    return taps;
}

Eigen::Vector3d MotionHistory::position(const Taps& taps, Eigen::Index point) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < taps.count; ++i)
        sum += taps.weights[i] * at(taps.first + i).xyz.col(point);
    return sum;
}

}  // namespace defrec
