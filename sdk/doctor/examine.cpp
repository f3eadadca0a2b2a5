// Everything that the doctor looks at, and what follows from what.
#include <algorithm>
#include <initializer_list>
#include <string_view>
#include <utility>

#include "sdk/doctor/findings.hpp"

namespace defrec::cli {
namespace {

struct Step {
    Finding (*look)(const Evidence&);
    // The look would find a consequence, where one of these was found.
    std::vector<std::string_view> after;
};

// In the order in which what is found is to be mended.
const std::vector<Step>& steps() {
    static const std::vector<Step> all = {
        {look_at_exposure, {}},
        {look_at_black_frames, {}},
        {look_at_white_frames, {}},
        {look_at_repeated_frames, {}},
        {look_at_bars, {"exposure"}},
        {look_at_interlacing, {}},
        {look_at_compression, {}},
        {look_at_sharpness, {"exposure", "interlacing", "compression"}},
        {look_at_one_view_twice, {"exposure"}},
        {look_at_common_content, {"exposure", "one_view_twice"}},
        {look_at_overlap, {"one_view_twice", "common_content"}},
        {look_at_resolution, {}},
        {look_at_order, {"one_view_twice", "common_content", "resolution"}},
        {look_at_pose, {"one_view_twice", "common_content", "resolution", "order"}},
        {look_at_units, {"one_view_twice"}},
        {look_at_baseline, {"one_view_twice", "resolution", "order", "pose", "units"}},
        {look_at_lag, {"one_view_twice", "interlacing", "resolution", "order", "pose"}},
        {look_at_rows, {"one_view_twice", "interlacing", "resolution", "order", "pose", "lag"}},
        {look_at_disparity_range,
         {"one_view_twice", "interlacing", "resolution", "order", "pose", "units", "baseline"}},
        {look_at_calibration, {"resolution", "order", "pose", "units", "baseline"}},
        {look_at_followed,
         {"exposure", "interlacing", "one_view_twice", "common_content", "resolution", "order",
          "pose", "units", "baseline", "lag", "disparity_range", "calibration"}},
    };
    return all;
}

}  // namespace

std::vector<Finding> look_at_everything(const Evidence& evidence) {
    std::vector<Finding> findings;
    for (const Step& step : steps()) {
        Finding finding = step.look(evidence);
        const auto cause =
            std::find_if(findings.begin(), findings.end(), [&](const Finding& earlier) {
                return earlier.verdict == Verdict::kFound &&
                       std::find(step.after.begin(), step.after.end(), earlier.id) !=
                           step.after.end();
            });
        if (cause != findings.end()) {
            finding.verdict = Verdict::kUnknown;
            finding.what = "it shows once this is mended: " + cause->title;
            finding.remedy.clear();
            finding.value.reset();
        }
        findings.push_back(std::move(finding));
    }
    return findings;
}

}  // namespace defrec::cli
