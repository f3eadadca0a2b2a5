// Marks and text that several painters of the left image draw.
#pragma once

#include <cstddef>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "sdk/report/record.hpp"
#include "sdk/report/target_mark.hpp"

namespace defrec::cli {

inline constexpr int kSubpixelBits = 4;
/// Points or targets that have labels; those of more would hide the tissue.
inline constexpr std::size_t kMostLabels = 40;
/// Targets without names that have labels: numbers of more would bury the parts.
inline constexpr std::size_t kMostNumbered = 6;

/// Text, and what is drawn behind text and marks.
extern const cv::Scalar kLight, kDark;

/// The report page (web/colours.js) uses the same colours.
const cv::Scalar& status_colour(VertexStatus status);

/// Within the image or a little beside it; false for NaN.
bool near_image(float u, float v, const cv::Mat& image);
/// With kSubpixelBits.
cv::Point fixed_point(float u, float v);
double text_scale(const cv::Mat& image);

/// A circle, dashed where asked for.
void ring(cv::Mat& image, float u, float v, double radius, bool dashed, const cv::Scalar& colour);
/// Labels beside marks, as many as have room beside each other and above the line of text at the
/// bottom.
class Labels {
  public:
    // Which come first; those of a rank come in their order.
    enum class Rank { kPart, kPoint, kTarget };
    void add(Rank rank, const std::string& text, float u, float v);
    /// Light, with a dark edge. highest: row of the image, which none crosses.
    void draw(cv::Mat& image, int highest);
    std::size_t size() const { return labels_.size(); }

  private:
    struct Label {
        Rank rank;
        std::string text;
        float u, v;
    };
    std::vector<Label> labels_;
};

/// A cross with a ring as wide as the expected error, dashed where the target is not observed.
/// False, and nothing, for what is lost or not in the image.
bool draw_target(cv::Mat& image, const PointEstimate& target, const Projector& projector);
/// "liver +/-2.1 mm"; the letters of the pictures have no sign for both.
std::string label_text(const std::string& name, double expected_error_mm);

}  // namespace defrec::cli
