// Whether the views are lit, in frames in which they show anything: neither white nor black.
#include <opencv2/imgproc.hpp>

#include "include/defrec_c.h"
#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"

namespace defrec::cli {
namespace {

using Decision = decisions::DoctorImages;

struct Light {
    double lit = 0;        // share of the view that is no black border
    double saturated = 0;  // share of the lit pixels
    double bright = 0;     // gray level where the brightest of the lit pixels begin
};

Light light_of(const cv::Mat& gray) {
    constexpr int kLevels = 256;
    double counts[kLevels] = {};
    for (int y = 0; y < gray.rows; ++y)
        for (int x = 0; x < gray.cols; ++x) ++counts[gray.at<std::uint8_t>(y, x)];
    double lit = 0, saturated = 0;
    for (int level = 0; level < kLevels; ++level) {
        if (level > Decision::kBorder) lit += counts[level];
        if (level >= Decision::kSaturated) saturated += counts[level];
    }
    if (lit == 0) return {};
    Light light{lit / static_cast<double>(gray.total()), saturated / lit, 0};
    double above = 0;
    for (int level = kLevels - 1; level > Decision::kBorder; --level) {
        above += counts[level];
        if (above < Decision::kBrightShare * lit) continue;
        light.bright = level;
        break;
    }
    return light;
}

Light mean_light(const Evidence& evidence, cv::Mat GrayPair::*view) {
    Light mean;
    const double share = 1.0 / static_cast<double>(evidence.pairs.size());
    for (const GrayPair& pair : evidence.pairs) {
        const Light light = light_of(pair.*view);
        mean.lit += share * light.lit;
        mean.saturated += share * light.saturated;
        mean.bright += share * light.bright;
    }
    return mean;
}

enum Fault { kNoFault, kBlackView, kDarkView, kWhiteView };

Fault fault_of(const Light& light) {
    return light.lit < Decision::kMinLit               ? kBlackView
           : light.bright < Decision::kDark            ? kDarkView
           : light.saturated > Decision::kMaxSaturated ? kWhiteView
                                                       : kNoFault;
}

Look& measured(Look& look, Fault fault, const Light& light) {
    return fault == kBlackView  ? look.measured(100 * (1 - light.lit), "%")
           : fault == kDarkView ? look.measured(light.bright, "gray levels")
                                : look.measured(100 * light.saturated, "%");
}

// The fault of a view, or of the better one of two; it: "it", "each".
std::string words_of(Fault fault, const Light& light, const std::string& it) {
    if (fault == kBlackView)
        return "black: " + percent(1 - light.lit) + " of " + it +
               " is no brighter than gray level " + format_fixed(Decision::kBorder, 0) + " of 255.";
    if (fault == kDarkView)
        return "dark: " + percent(Decision::kBrightShare) + " of " + it +
               " is brighter than gray level " + format_fixed(light.bright, 0) + " of 255, and " +
               percent(1 - light.lit) + " of " + it + " is black.";
    return "overexposed: " + percent(light.saturated) + " of " + it +
           " is white, where nothing can be followed.";
}

constexpr char kLessLight[] =
    "Lower the light, the gain or the exposure time, or let the camera meter the whole view.";

Finding found_in_one(Look& look, Fault fault, const Light& light, const char* name) {
    return measured(look, fault, light)
        .found(std::string("the ") + name + " view is " + words_of(fault, light, "it"),
               fault == kWhiteView ? kLessLight
                                   : "Check light, shutter, cable and video input of this view.");
}

// A cable or an input is one view's: what both have in common is the light.
Finding found_in_both(Look& look, Fault fault, const Light& left, const Light& right) {
    Light light = left;
    if (fault == kBlackView) light.lit = std::max(left.lit, right.lit);
    if (fault == kDarkView && right.bright > left.bright) light = right;
    if (fault == kWhiteView) light.saturated = std::min(left.saturated, right.saturated);
    return measured(look, fault, light)
        .found("both views are " + words_of(fault, light, "each"),
               fault == kWhiteView
                   ? kLessLight
                   : "Raise the light, the gain or the exposure time, and see that the lens is not "
                     "covered and that the recording begins once the light is on.");
}

}  // namespace

Finding look_at_exposure(const Evidence& evidence) {
    Look look("exposure", "exposure", Severity::kError);
    const Light left = mean_light(evidence, &GrayPair::left),
                right = mean_light(evidence, &GrayPair::right);
    for (const Fault fault : {kBlackView, kDarkView, kWhiteView}) {
        const bool is_left = fault_of(left) == fault, is_right = fault_of(right) == fault;
        if (is_left && is_right) return found_in_both(look, fault, left, right);
        if (is_left || is_right)
            return found_in_one(look, fault, is_left ? left : right, is_left ? "left" : "right");
    }
    const double worst = std::max(left.saturated, right.saturated);
    const double frames = static_cast<double>(evidence.probe.frames.size());
    const std::size_t unusable =
        evidence.probe.lit_frames_with(DEFREC_REASON_NO_TEXTURE | DEFREC_REASON_ONE_VIEW);
    if (static_cast<double>(unusable) > Decision::kReasonShare * frames)
        return look.measured(100 * static_cast<double>(unusable) / frames, "%")
            .found("in " + of_frames(unusable, evidence.probe.frames.size()) +
                       " a view is without contrast.",
                   "Check light, lens, cable and video input.");
    return look.measured(100 * worst, "%")
        .fine("at most " + percent(worst) + " of a view is white");
}

}  // namespace defrec::cli
