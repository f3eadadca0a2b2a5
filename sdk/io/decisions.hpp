// The numbers by which a calibration file or a mesh is refused or doubted, as
// scripts/decisions/header.py reads them: unit | what it decides | source.
#pragma once

#include <cstddef>

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
    // px | a larger image is refused | the largest that cv::remap takes
    static constexpr int kMaxImageSide = 32766;
    // sides of the image | a principal point farther outside is refused | set by hand
    static constexpr double kMaxOutside = 0.5;
};

// Meshes of other programs.
struct MeshFiles {
    // bytes | a larger file is refused | two million triangles of STL as text take 0.5e9
    static constexpr std::size_t kMaxBytes = 1000000000;
    // triangles | more are refused | as RegistrationModel
    static constexpr std::size_t kMaxTriangles = 2000000;
    // vertices | likewise | three for each triangle
    static constexpr std::size_t kMaxVertices = 6000000;
    // corners | of a polygon, at most | set by hand
    static constexpr std::size_t kMaxCorners = 255;
    // groups | of a file, at most | set by hand
    static constexpr std::size_t kMaxParts = 1000;
    // numbers | of a vertex of PLY, at most | set by hand
    static constexpr std::size_t kMaxColumns = 64;
    // characters | of a line of a header, at most | set by hand
    static constexpr std::size_t kMaxLine = 10000;
    // m | a mesh without a unit whose longest side is shorter is refused | organs are longer
    static constexpr double kMinMetres = 0.01;
    // m | and up to here it is in metres, where no unit is given | organs are shorter, and in mm
    // longer
    static constexpr double kMaxMetres = 1;
    // mm | the longest side of a mesh without a unit, at least | as kMinMetres
    static constexpr double kMinSide = 10;
    // mm | and of one whose unit is given | as RegistrationModel
    static constexpr double kMinSideOfUnit = 3;
    // mm | and at most | as RegistrationModel
    static constexpr double kMaxSide = 2000;
};

}  // namespace defrec::decisions
