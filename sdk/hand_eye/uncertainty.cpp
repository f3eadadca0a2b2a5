// See uncertainty.hpp.
#include "sdk/hand_eye/uncertainty.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

#include "sdk/base/util/error.hpp"
#include "sdk/hand_eye/cross_matrix.hpp"
#include "sdk/hand_eye/decisions.hpp"

namespace defrec {
namespace {

using decisions::HandEyeFit;
using decisions::HandEyeVerdicts;

// The information on the parameters `kept` where those of `others` are unknown as well.
Eigen::MatrixXd reduced(const HandEyeInformation& information, const std::vector<int>& kept,
                        const std::vector<int>& others) {
    const Eigen::MatrixXd own = information(kept, kept), shared = information(kept, others);
    Eigen::MatrixXd rest = information(others, others);
    rest.diagonal().array() += HandEyeFit::kDamping * rest.diagonal().maxCoeff();
    return own - shared * rest.ldlt().solve(shared.transpose());
}

std::vector<int> numbers(int begin, int end) {
    std::vector<int> made;
    for (int i = begin; i < end; ++i) made.push_back(i);
    return made;
}

double sigma_of(double information, double variance_scale) {
    return information > 0 ? std::sqrt(variance_scale / information)
                           : std::numeric_limits<double>::infinity();
}

HandEyeOpenMotion open_motion(const HandEyeResidual& direction, double sigma_mm) {
    HandEyeOpenMotion open;
    const Eigen::Vector3d turn = direction.head<3>(), shift = direction.tail<3>();
    open.is_turn = turn.norm() > shift.norm();
    open.axis = (open.is_turn ? turn : shift).normalized();
    Eigen::Index largest = 0;
    open.axis.cwiseAbs().maxCoeff(&largest);
    if (open.axis[largest] < 0) open.axis = -open.axis;
    open.expected = open.is_turn ? sigma_mm / HandEyeFit::kLength : sigma_mm;
    return open;
}

}  // namespace

std::string HandEyeOpenMotion::text() const {
    constexpr double kHundred = 100;
    std::string made = is_turn ? "turn about (" : "shift along (";
    for (int i = 0; i < 3; ++i)
        made += concat(i > 0 ? " " : "", std::round(kHundred * axis[i]) / kHundred + 0.0);
    return made + ")";
}

HandEyeUncertainty hand_eye_uncertainty(const HandEyeFitted& fitted, bool has_offset,
                                        double variance_scale, double max_error_mm) {
    HandEyeUncertainty made;
    const int count = has_offset ? kHandEyeOffsetAt + 1 : kHandEyeOffsetAt;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(
        reduced(fitted.information, numbers(0, 6), numbers(6, count)));
    HandEyeMatrix covariance = HandEyeMatrix::Zero();
    for (int i = 0; i < 6; ++i) {
        const HandEyeResidual direction = solver.eigenvectors().col(i);
        double sigma = sigma_of(solver.eigenvalues()[i], variance_scale);
        if (!(sigma <= max_error_mm)) {
            made.open.push_back(
                open_motion(direction, std::min(sigma, HandEyeVerdicts::kExpected)));
            sigma = HandEyeVerdicts::kExpected;
        }
        covariance += sigma * sigma * direction * direction.transpose();
    }
    // From turn times length and shift of the camera to a motion about the marker's origin.
    HandEyeMatrix change = HandEyeMatrix::Zero();
    change.topLeftCorner<3, 3>().diagonal().setConstant(1 / HandEyeFit::kLength);
    change.bottomLeftCorner<3, 3>() =
        cross_matrix(fitted.transforms.marker_from_camera.translation()) / HandEyeFit::kLength;
    change.bottomRightCorner<3, 3>().setIdentity();
    made.covariance = change * covariance * change.transpose();

    if (has_offset)
        made.offset_sigma_s = sigma_of(
            reduced(fitted.information, {kHandEyeOffsetAt}, numbers(0, kHandEyeOffsetAt))(0, 0),
            variance_scale);
    const double factor = reduced(fitted.information, {kHandEyeFactorAt}, numbers(0, count))(0, 0);
    made.length_factor_sigma = sigma_of(factor, variance_scale);
    if (factor > 0) made.length_factor = 1 - fitted.gradient[kHandEyeFactorAt] / factor;
    return made;
}

}  // namespace defrec
