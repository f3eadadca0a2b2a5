// See drawing.hpp.
#include "sdk/report/drawing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>

namespace defrec::cli {
namespace {

const cv::Scalar kObserved(191, 212, 45);
const cv::Scalar kExtrapolated(36, 191, 251);
const cv::Scalar kUnknown(175, 163, 156);

}  // namespace

const cv::Scalar kLight(245, 245, 245), kDark(42, 23, 15);

const cv::Scalar& status_colour(VertexStatus status) {
    return status == VertexStatus::observed       ? kObserved
           : status == VertexStatus::extrapolated ? kExtrapolated
                                                  : kUnknown;
}

bool near_image(float u, float v, const cv::Mat& image) {
    const float margin = 64;
    return u > -margin && v > -margin && u < static_cast<float>(image.cols) + margin &&
           v < static_cast<float>(image.rows) + margin;  // false for NaN
}

cv::Point fixed_point(float u, float v) {
    constexpr float scale = 1 << kSubpixelBits;
    return {cvRound(u * scale), cvRound(v * scale)};
}

double text_scale(const cv::Mat& image) { return std::clamp(image.cols / 1700.0, 0.34, 1.2); }

void ring(cv::Mat& image, float u, float v, double radius, bool dashed, const cv::Scalar& colour) {
    constexpr int kDash = 20;  // degrees, and as many of a gap
    const double scale = 1 << kSubpixelBits;
    const cv::Size axes(cvRound(radius * scale), cvRound(radius * scale));
    // A dark edge tells it from lines of the surface in the same colour.
    for (const bool is_edge : {true, false})
        for (int start = 0; start < 360; start += 2 * kDash)
            cv::ellipse(image, fixed_point(u, v), axes, 0, start, start + (dashed ? 1 : 2) * kDash,
                        is_edge ? kDark : colour, is_edge ? 3 : 1, cv::LINE_AA, kSubpixelBits);
}

void Labels::add(Rank rank, const std::string& text, float u, float v) {
    labels_.push_back({rank, text, u, v});
}

void Labels::draw(cv::Mat& image, int highest) {
    const double scale = 0.8 * text_scale(image);
    const int gap = cvRound(8 + 6 * scale), lowest = image.rows - cvRound(50 * scale);
    std::stable_sort(labels_.begin(), labels_.end(),
                     [](const Label& a, const Label& b) { return a.rank < b.rank; });
    std::vector<cv::Rect> taken;
    for (const auto& [rank, text, u, v] : labels_) {
        if (!(u >= 0 && v >= 0 && u < float(image.cols) && v < float(image.rows))) continue;
        int below = 0;
        const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, scale, 1, &below);
        const int height = size.height + below;
        // On the right above, below; on the left above, below.
        for (int place = 0; place < 4; ++place) {
            const int wanted = cvRound(u) + (place < 2 ? gap : -gap - size.width);
            const int left = std::clamp(wanted, 2, std::max(2, image.cols - size.width - 2));
            const int top = cvRound(v) + (place % 2 == 0 ? -height - 2 : 4);
            const cv::Rect box(left, top, size.width, height);
            if (top < highest || box.br().y > lowest ||
                std::any_of(taken.begin(), taken.end(),
                            [&](const cv::Rect& other) { return (other & box).area() > 0; }))
                continue;
            taken.emplace_back(left, top, size.width + gap, height);
            for (const bool is_edge : {true, false})
                cv::putText(image, text, {left, top + size.height}, cv::FONT_HERSHEY_SIMPLEX, scale,
                            is_edge ? kDark : kLight, is_edge ? 3 : 1, cv::LINE_AA);
            break;
        }
    }
}

bool draw_target(cv::Mat& image, const PointEstimate& target, const Projector& projector) {
    constexpr float kMinRadius = 3;
    if (target.status == VertexStatus::unknown) return false;
    const TargetMark mark = target_mark(target, projector);
    if (!near_image(mark.u, mark.v, image)) return false;
    const cv::Scalar& colour = status_colour(target.status);
    for (const bool is_edge : {true, false})
        cv::drawMarker(image, cv::Point(cvRound(mark.u), cvRound(mark.v)), is_edge ? kDark : colour,
                       cv::MARKER_CROSS, 5, is_edge ? 3 : 1);
    if (std::isfinite(mark.radius))
        ring(image, mark.u, mark.v, std::max(mark.radius, kMinRadius),
             target.status != VertexStatus::observed, colour);
    return true;
}

std::string label_text(const std::string& name, double expected_error_mm) {
    std::array<char, 32> error{};
    std::snprintf(error.data(), error.size(), " +/-%.1f mm", expected_error_mm);
    return name + error.data();
}

}  // namespace defrec::cli
