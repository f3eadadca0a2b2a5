// The metrics of SurgT.
#include "sdk/evaluation/data_sets/surgt_metrics.hpp"

#include <algorithm>
#include <cmath>

namespace defrec::cli {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMissesToFail = 11;
constexpr double kMinOverlap = 0.1;
constexpr double kMaxErrorMm = 100;

cv::Point3d place_of(const cv::Point& left, double disparity, const cv::Matx44d& q) {
    const cv::Vec4d place = q * cv::Vec4d(left.x, left.y, disparity, 1);
    return {place[0] / place[3], place[1] / place[3], place[2] / place[3]};
}

// Misses in a row, in 2D or in 3D.
struct Misses {
    std::size_t in_a_row = 0;
    std::vector<BoxFrame*> assessed;

    bool has_failed() const { return in_a_row >= kMissesToFail; }
    // The frame's value has been set. True when the tracker has failed with this frame.
    bool add(BoxFrame& frame, bool is_hit) {
        assessed.push_back(&frame);
        in_a_row = is_hit ? 0 : in_a_row + 1;
        return has_failed();
    }
    // That of the frames with which it failed.
    void take_back(double BoxFrame::*value) const {
        std::for_each(assessed.end() - kMissesToFail, assessed.end(),
                      [value](BoxFrame* frame) { frame->*value = kNone; });
    }
};

void assess_2d(BoxFrame& frame, const BoxPair& truth, const std::optional<BoxPair>& predicted) {
    if (!predicted) return;
    double overlap[2], error[2];
    for (std::size_t view = 0; view < 2; ++view) {
        overlap[view] = overlap_of(truth[view], (*predicted)[view]);
        error[view] = cv::norm(box_centre(truth[view]) - box_centre((*predicted)[view]));
    }
    frame.overlap = (overlap[0] + overlap[1]) / 2;
    frame.error_px = (error[0] + error[1]) / 2;
    frame.is_hit_2d = overlap[0] > kMinOverlap && overlap[1] > kMinOverlap;
}

void assess_3d(BoxFrame& frame, const BoxPair& truth, const std::optional<BoxPair>& predicted,
               const cv::Matx44d& q) {
    if (!predicted) return;
    const auto disparity = [](const BoxPair& boxes) {
        return box_centre(boxes[0]).x - box_centre(boxes[1]).x;
    };
    const int true_disparity = disparity(truth), found_disparity = disparity(*predicted);
    if (true_disparity <= 0 || found_disparity <= 0) return;
    frame.error_mm = cv::norm(place_of(box_centre(truth[0]), true_disparity, q) -
                              place_of(box_centre((*predicted)[0]), found_disparity, q));
    frame.is_hit_3d = frame.error_mm <= kMaxErrorMm;
}

}  // namespace

double overlap_of(const Box& a, const Box& b) {
    const double width = std::min(a.u + a.width, b.u + b.width) - std::max(a.u, b.u);
    const double height = std::min(a.v + a.height, b.v + b.height) - std::max(a.v, b.v);
    const double common = std::max(0.0, width) * std::max(0.0, height);
    return common / (a.width * a.height + b.width * b.height - common);
}

cv::Point box_centre(const Box& box) {
    return {static_cast<int>(box.u + box.width / 2), static_cast<int>(box.v + box.height / 2)};
}

std::vector<BoxFrame> assess_boxes(const std::vector<TrueBoxes>& truth, std::size_t first,
                                   const std::vector<std::optional<BoxPair>>& predicted,
                                   const cv::Matx44d& q) {
    std::size_t last_counted = 0;
    for (std::size_t i = 0; i < truth.size(); ++i)
        if (truth[i].counts()) last_counted = i;

    std::vector<BoxFrame> frames(predicted.size());
    Misses misses_2d, misses_3d;
    for (std::size_t i = 0; i < predicted.size(); ++i) {
        const std::size_t number = first + 1 + i;
        const TrueBoxes& of_frame = truth.at(number);
        BoxFrame& frame = frames[i];
        const int times = number <= last_counted ? 1 : 0;
        if (misses_2d.has_failed() && misses_3d.has_failed() && times == 0) break;
        frame.is_counted = of_frame.counts();
        frame.times_in_curve = times;
        if (!of_frame.counts()) {
            // A prediction where there is nothing to be seen.
            frame.is_counted = !of_frame.is_difficult && !of_frame.boxes && predicted[i] &&
                               !(misses_2d.has_failed() && misses_3d.has_failed());
            continue;
        }
        frame.overlap_in_curve = 0;
        if (misses_2d.has_failed())
            frame.times_in_curve = misses_3d.has_failed() ? times : 2 * times;
        if (!misses_3d.has_failed()) {
            assess_3d(frame, *of_frame.boxes, predicted[i], q);
            if (misses_3d.add(frame, frame.is_hit_3d)) misses_3d.take_back(&BoxFrame::error_mm);
        }
        if (misses_2d.has_failed()) continue;
        assess_2d(frame, *of_frame.boxes, predicted[i]);
        if (predicted[i]) frame.overlap_in_curve = frame.overlap;
        if (!misses_2d.add(frame, frame.is_hit_2d)) continue;
        misses_2d.take_back(&BoxFrame::overlap);
        misses_2d.take_back(&BoxFrame::error_px);
    }
    return frames;
}

OverlapCurve mean_curve(const std::vector<OverlapCurve>& curves) {
    std::size_t length = 0;
    for (const OverlapCurve& curve : curves) length = std::max(length, curve.size());
    OverlapCurve mean(length);
    for (std::size_t i = 0; i < length; ++i) {
        double sum = 0;
        int count = 0;
        for (const OverlapCurve& curve : curves) {
            if (i >= curve.size() || !curve[i]) continue;
            sum += *curve[i];
            ++count;
        }
        if (count > 0) mean[i] = sum / count;
    }
    return mean;
}

double expected_average_overlap(const OverlapCurve& curve, std::size_t first, std::size_t last) {
    if (curve.empty()) return 0;
    double sum = 0;
    int count = 0;
    for (std::size_t i = first; i < std::min(last, curve.size()); ++i) {
        if (!curve[i]) continue;
        sum += *curve[i];
        ++count;
    }
    return count > 0 ? sum / count : kNone;
}

}  // namespace defrec::cli
