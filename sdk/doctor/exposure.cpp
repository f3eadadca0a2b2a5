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

}  // namespace

Finding look_at_exposure(const Evidence& evidence) {
    Look look("exposure", "exposure", Severity::kError);
    struct View {
        const char* name;
        Light light;
    };
    const View views[] = {{"left", mean_light(evidence, &GrayPair::left)},
                          {"right", mean_light(evidence, &GrayPair::right)}};
    double worst = 0;
    for (const auto& [name, light] : views) {
        const std::string view = std::string("the ") + name + " view";
        worst = std::max(worst, light.saturated);
        if (light.lit < Decision::kMinLit)
            return look.measured(100 * (1 - light.lit), "%")
                .found(view + " is black: " + percent(1 - light.lit) +
                           " of it is no brighter than gray level " +
                           format_fixed(Decision::kBorder, 0) + " of 255.",
                       "Check light, shutter, cable and video input of this view.");
        if (light.bright < Decision::kDark)
            return look.measured(light.bright, "gray levels")
                .found(view + " is dark: " + percent(Decision::kBrightShare) +
                           " of it are brighter than gray level " + format_fixed(light.bright, 0) +
                           " of 255, and " + percent(1 - light.lit) + " of it are black.",
                       "Check light, shutter, cable and video input of this view.");
        if (light.saturated > Decision::kMaxSaturated)
            return look.measured(100 * light.saturated, "%")
                .found(view + " is overexposed: " + percent(light.saturated) +
                           " of it is white, where nothing can be followed.",
                       "Lower the light, the gain or the exposure time, or let the camera meter "
                       "the whole view.");
    }
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
