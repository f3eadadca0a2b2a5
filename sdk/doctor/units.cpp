// Whether T is in another unit than millimetres.
#include <array>

#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/lengths.hpp"
#include "sdk/doctor/sentence.hpp"

namespace defrec::cli {
namespace {

constexpr std::array kNames = {"metres", "centimetres", "inches", "micrometres"};

}  // namespace

Finding look_at_units(const Evidence& evidence) {
    Look look("units", "units", Severity::kError);
    const double baseline = baseline_of(evidence.calibration), depth = depth_of(evidence);
    look.measured(baseline, "mm");
    const std::string text =
        "the baseline is " + format_fixed(baseline, baseline < 1 ? 4 : 2) + " mm" +
        (depth > 0 ? ", and the tissue " + format_fixed(depth, baseline < 1 ? 3 : 1) + " mm away"
                   : "");
    if (are_plausible(baseline, depth)) return look.fine(text);
    for (std::size_t i = 0; i < kNames.size(); ++i) {
        const double unit = decisions::DoctorLengths::kUnits[i];
        if (!are_plausible(unit * baseline, unit * depth)) continue;
        return look.found(
            "T is not in millimetres: " + text + "; in " + kNames[i] + " it would be " +
                format_fixed(unit * baseline, 2) + " mm" +
                (depth > 0 ? " and " + format_fixed(unit * depth, 0) + " mm" : "") + ".",
            unit == 1000 ? "Pass --units m, or write T in mm."
                         : std::string("Write T in mm, if it is in ") + kNames[i] + ".");
    }
    return look.fine(text + ", which no other unit explains");
}

}  // namespace defrec::cli
