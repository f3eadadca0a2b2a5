// The numbers by which a calibration file is refused or doubted, as in
// sdk/tracking/frame/decisions.hpp: unit | what it decides | source.
#pragma once

namespace defrec::decisions {

// The limits of what a file says of a stereo endoscope or microscope; RigLimits are the library's.
struct CalibrationFile {
    // mm | a shorter baseline is refused | set by hand: no stereo camera has less
    static constexpr double kMinBaseline = 0.1;
    // mm | a longer one is refused | set by hand
    static constexpr double kMaxBaseline = 1000;
    // mm | a shorter one is refused where no unit is given: it is more likely in centimetres or
    //   inches | set by hand
    static constexpr double kSuspectBaseline = 1;
    // 1 | an element of R^T R - 1, at most | files round to six digits
    static constexpr double kRotationTolerance = 1e-3;
    // 1 | an element of P and R, by which views count as rectified, at most | rounding
    static constexpr double kRectifiedTolerance = 1e-9;
    // sides of the image | a principal point farther outside is refused | set by hand
    static constexpr double kMaxOutside = 0.5;
};

}  // namespace defrec::decisions
