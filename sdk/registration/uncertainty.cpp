// See uncertainty.hpp. Motions that slide a surface within itself have no information by its
// normals (Gelfand and Guibas, Shape segmentation using local slippage analysis, SGP 2004). The
// error of a target follows from the covariance of the pose, as Fitzpatrick, West and Maurer derive
// it for point pairs (Predicting error in rigid-body point-based registration, IEEE Trans. Med.
// Imaging 17, 1998).
#include "sdk/registration/uncertainty.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "sdk/base/util/error.hpp"
#include "sdk/registration/decisions.hpp"

namespace defrec {
namespace {

using decisions::FreeMotions;

using Basis = Eigen::Matrix<double, 6, Eigen::Dynamic>;

float rounded(double value) {
    return static_cast<float>(std::round(value / FreeMotions::kTextStep) * FreeMotions::kTextStep) +
           0.0f;
}

std::string text(const Eigen::Vector3d& at) {
    return concat("(", rounded(at.x()), " ", rounded(at.y()), " ", rounded(at.z()), ")");
}

// Unit length; which way an axis points means nothing: its largest component is positive.
Eigen::Vector3d upright(const Eigen::Vector3d& along) {
    Eigen::Index largest = 0;
    along.cwiseAbs().maxCoeff(&largest);
    return along.normalized() * (along[largest] < 0 ? -1 : 1);
}

FreeMotion motion_of(const Twist& direction, const PoseInformation& information,
                     double expected_mm) {
    FreeMotion motion;
    motion.expected_mm = expected_mm;
    const Eigen::Vector3d turn = direction.head<3>() / information.length,
                          shift = direction.tail<3>();
    motion.is_turn = turn.norm() * information.length > FreeMotions::kMinTurn;
    if (!motion.is_turn) {
        motion.axis = upright(shift);
        return motion;
    }
    motion.axis = upright(turn);
    motion.point = information.centre + turn.cross(shift) / turn.squaredNorm();
    motion.pitch_mm = turn.dot(shift) / turn.squaredNorm();
    return motion;
}

// The same space by pure shifts first, as far as there are any, then turns.
Basis in_plain_form(const Basis& space) {
    if (space.cols() == 0) return space;
    const Eigen::MatrixXd turns = space.topRows<3>().transpose() * space.topRows<3>();
    return space * Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(turns).eigenvectors();
}

}  // namespace

std::string FreeMotion::text() const {
    if (!is_turn) return "shift along " + defrec::text(axis);
    std::string made =
        concat("turn about the axis ", defrec::text(axis), " through ", defrec::text(point), " mm");
    constexpr double kDegree = std::numbers::pi / 180;
    if (std::abs(pitch_mm) * kDegree > FreeMotions::kTextStep)
        made += concat(" with a shift of ", rounded(pitch_mm * kDegree), " mm along it per degree");
    return made;
}

void PoseInformation::add(const Twist& gradient, double weight) {
    matrix.noalias() += weight * gradient * gradient.transpose();
}

PoseUncertainty uncertainty_of(const PoseInformation& information, double whole, double min_share,
                               double max_error_mm) {
    const Eigen::SelfAdjointEigenSolver<TwistMatrix> solver(information.matrix);
    PoseUncertainty result;
    constexpr double kMost = FreeMotions::kExpected * FreeMotions::kExpected;
    const auto variance_of = [&](double value) {
        return value * kMost > information.variance_scale ? information.variance_scale / value
                                                          : kMost;
    };
    Twist variance;
    Eigen::Index free = 0;
    for (Eigen::Index i = 0; i < 6; ++i) {
        const double value = solver.eigenvalues()[i];  // they rise
        variance[i] = variance_of(value);
        if (value <= min_share * whole || variance[i] > max_error_mm * max_error_mm) free = i + 1;
    }
    if (free < variance.size()) result.worst_mm = std::sqrt(variance[free]);
    variance.head(free).setConstant(kMost);
    const Basis space = in_plain_form(solver.eigenvectors().leftCols(free));
    for (Eigen::Index i = 0; i < free; ++i) {
        const Twist direction = space.col(i);
        const double value = direction.dot(information.matrix * direction);
        result.free.push_back(motion_of(direction, information, std::sqrt(variance_of(value))));
    }
    const TwistMatrix spread = twist_to_origin(information.centre, information.length) *
                               solver.eigenvectors() * variance.cwiseSqrt().asDiagonal();
    result.covariance = spread * spread.transpose();
    return result;
}

// A turn about the centre is one about the origin and a shift.
TwistMatrix twist_to_origin(const Eigen::Vector3d& centre, double length) {
    TwistMatrix made = TwistMatrix::Zero();
    made.topLeftCorner<3, 3>() = Eigen::Matrix3d::Identity() / length;
    made.bottomRightCorner<3, 3>().setIdentity();
    made.bottomLeftCorner<3, 3>() = -place_shift(centre).leftCols<3>() / length;
    return made;
}

}  // namespace defrec
