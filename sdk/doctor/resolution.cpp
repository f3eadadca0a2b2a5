// Whether the calibration is for images of the frames' size.
#include <cmath>

#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"

namespace defrec::cli {
namespace {

using Decision = decisions::DoctorSize;

std::string scaling_remedy(double x) {
    return "Calibrate with images of the video's size, record in the calibration's, or, if the "
           "video was resized, multiply fx, cx, fy and cy of M1 and M2 by " +
           format_fixed(x, 4) + " and set image_width and image_height.";
}

// How far a principal point lies from the middle of a side, in both directions the less.
double far_off(const CameraCalibration& camera, const Evidence& evidence) {
    return std::min(std::abs((camera.cx + 0.5) / evidence.width - 0.5),
                    std::abs((camera.cy + 0.5) / evidence.height - 0.5));
}

}  // namespace

Finding look_at_resolution(const Evidence& evidence) {
    Look look("resolution", "resolution", Severity::kError);
    const StereoCalibration& calibration = evidence.calibration;
    const std::string frames = "the frames are " + size_text(evidence.width, evidence.height);
    if (evidence.has_other_size) {
        const double x = static_cast<double>(evidence.width) / calibration.width,
                     y = static_cast<double>(evidence.height) / calibration.height;
        look.measured(x, "");
        const std::string what =
            frames + ", the calibration is for " + size_text(calibration.width, calibration.height);
        if (std::abs(x / y - 1) < Decision::kSameAspect)
            return look.found(what + ".", scaling_remedy(x));
        return look.found(
            what + ", a picture of another shape.",
            "Find out whether the video was cropped, padded, squeezed or made of single fields; "
            "record it in the calibration's size, or calibrate anew with the video's.");
    }
    const double off =
        std::min(far_off(calibration.left, evidence), far_off(calibration.right, evidence));
    look.measured(100 * off, "%");
    if (off > Decision::kFarOff) {
        const double scale =
            0.5 * evidence.width / (0.5 * (calibration.left.cx + calibration.right.cx) + 0.5);
        return look.found(
            "the calibration seems to be for images of another size: its principal points lie at "
            "(" +
                format_fixed(calibration.left.cx, 0) + ", " + format_fixed(calibration.left.cy, 0) +
                ") and (" + format_fixed(calibration.right.cx, 0) + ", " +
                format_fixed(calibration.right.cy, 0) + "), and " + frames + ".",
            scaling_remedy(scale));
    }
    if (calibration.width > 0) return look.fine("frames and calibration are of one size");
    return look.fine("the principal points lie in the middle of the frames");
}

}  // namespace defrec::cli
