// A straight instrument: a cylinder with a round tip. Geometry only.
#pragma once

#include <Eigen/Core>
#include <algorithm>

namespace defrec::cli {

struct Instrument {
    Eigen::Vector3d tip = Eigen::Vector3d::Zero();    ///< centre of the round tip, mm
    Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< unit, from the tip along the shaft
    double radius = 2.5;                              ///< mm
    double length = 140;                              ///< mm
};

/// Where a line from `origin` comes nearest to the instrument's axis.
struct Approach {
    double along_line = 0;  ///< parameter of the line, 1 at origin + direction
    double along_axis = 0;  ///< mm from the tip
    double distance = 0;    ///< mm between the two
};

/// The line is taken for parameters from..to. Source: closest points of two segments, Ericson,
/// Real-Time Collision Detection, 5.1.9; here by alternating clamps, which is exact for this pair.
inline Approach nearest_approach(const Instrument& instrument, const Eigen::Vector3d& origin,
                                 const Eigen::Vector3d& direction, double from, double to) {
    const Eigen::Vector3d r = origin - instrument.tip;
    const double a = direction.squaredNorm();
    const double b = direction.dot(instrument.axis);
    const double c = direction.dot(r);
    const double f = instrument.axis.dot(r);
    const double determinant = a - b * b;
    Approach nearest;
    double line = determinant > 1e-12 * a ? (b * f - c) / determinant : from;
    line = std::clamp(line, from, to);
    double axis = b * line + f;
    if (axis < 0 || axis > instrument.length) {
        axis = std::clamp(axis, 0.0, instrument.length);
        line = std::clamp((b * axis - c) / a, from, to);
    }
    nearest.along_line = line;
    nearest.along_axis = axis;
    nearest.distance = (r + line * direction - axis * instrument.axis).norm();
    return nearest;
}

}  // namespace defrec::cli
