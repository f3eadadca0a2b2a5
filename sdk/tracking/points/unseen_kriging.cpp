// See unseen_kriging.hpp.
#include "sdk/tracking/points/unseen_kriging.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>

namespace defrec {
namespace {

constexpr Eigen::Index kLeaf = 16;  // rows of a triangle that is not parted further

// In place. Blocks of a half each: most of the work is products of matrices.
void invert_lower(Eigen::Ref<Eigen::MatrixXd> triangle) {
    const Eigen::Index rows = triangle.rows(), half = rows / 2;
    if (rows <= kLeaf) {
        const Eigen::MatrixXd inverse =
            triangle.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(rows, rows));
        triangle = inverse;
        return;
    }
    invert_lower(triangle.topLeftCorner(half, half));
    invert_lower(triangle.bottomRightCorner(rows - half, rows - half));
    const Eigen::MatrixXd right =
        triangle.bottomLeftCorner(rows - half, half) * triangle.topLeftCorner(half, half);
    triangle.bottomLeftCorner(rows - half, half).noalias() =
        -triangle.bottomRightCorner(rows - half, rows - half) * right;
}

// The factor's upper triangle is 0.
Eigen::MatrixXd inverse_of_factor(const Eigen::MatrixXd& symmetric) {
    Eigen::MatrixXd factor = symmetric.llt().matrixL();
    invert_lower(factor);
    return factor;
}

Eigen::MatrixXd product_with_itself(const Eigen::MatrixXd& factor) {
    Eigen::MatrixXd product = Eigen::MatrixXd::Zero(factor.cols(), factor.cols());
    product.selfadjointView<Eigen::Lower>().rankUpdate(factor.transpose());
    product.triangularView<Eigen::StrictlyUpper>() = product.transpose();
    return product;
}

}  // namespace

DisplacementModel::DisplacementModel(Eigen::MatrixXd shapes_of_modes,
                                     const Eigen::Matrix3Xd& from_centre)
    : shapes(std::move(shapes_of_modes)) {
    const MotionSlope all = motion_slope(from_centre);
    for (Eigen::Index axis = 0; axis < 3; ++axis)
        slope[static_cast<size_t>(axis)] = all(Eigen::seqN(axis, places(), 3), Eigen::all);
}

void add_on_axes(const Eigen::MatrixXd& values, Eigen::MatrixXd& sum) {
    for (Eigen::Index axis = 0; axis < 3; ++axis)
        sum.block(axis * values.rows(), axis * values.cols(), values.rows(), values.cols()) +=
            values;
}

Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& symmetric) {
    return product_with_itself(inverse_of_factor(symmetric));
}

void UnseenKriging::weigh(const Eigen::VectorXd& noise) {
    weight_ = noise.cwiseInverse();
    const Eigen::Index modes = seen_.modes(), all = 3 * modes + 6;
    const Eigen::MatrixXd weighed = weight_.asDiagonal() * seen_.shapes;
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(all, all);
    information.topLeftCorner(3 * modes, 3 * modes) = information_;
    add_on_axes(seen_.shapes.transpose() * weighed, information);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
        const MotionSlope& slope = seen_.slope[static_cast<size_t>(axis)];
        // The lower triangle is read.
        information.block(3 * modes, axis * modes, 6, modes) = slope.transpose() * weighed;
        information.bottomRightCorner<6, 6>() += slope.transpose() * weight_.asDiagonal() * slope;
    }
    reducer_ = inverse_of_factor(information);
}

UnseenKriging::Found UnseenKriging::solve(const Eigen::Matrix3Xd& displacements) const {
    const Eigen::Index modes = seen_.modes();
    Eigen::VectorXd sums = Eigen::VectorXd::Zero(reducer_.rows());
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
        const Eigen::VectorXd weighed = weight_.cwiseProduct(displacements.row(axis).transpose());
        sums.segment(axis * modes, modes) = seen_.shapes.transpose() * weighed;
        sums.tail<6>() += seen_.slope[static_cast<size_t>(axis)].transpose() * weighed;
    }
    const Eigen::VectorXd reduced = reducer_ * sums, found = reducer_.transpose() * reduced;
    return {found.head(3 * modes).reshaped(modes, 3), found.tail<6>()};
}

// The reducer times the model of places along an axis, a column for each place.
Eigen::MatrixXd UnseenKriging::reduce(const DisplacementModel& of, size_t axis) const {
    const Eigen::Index modes = of.modes(), above = static_cast<Eigen::Index>(axis) * modes,
                       below = reducer_.rows() - above;
    Eigen::MatrixXd reduced(reducer_.rows(), of.places());
    reduced.topRows(above).setZero();
    reduced.bottomRows(below).noalias() =
        reducer_.block(above, above, below, modes) * of.shapes.transpose();
    reduced.bottomRows<6>() += reducer_.bottomRightCorner<6, 6>() * of.slope[axis].transpose();
    return reduced;
}

double UnseenKriging::raise_noise(const Eigen::Matrix3Xd& displacements,
                                  Eigen::VectorXd& noise) const {
    const Found found = solve(displacements);
    Eigen::Matrix3Xd left = displacements - (seen_.shapes * found.coefficients).transpose();
    std::array<Eigen::MatrixXd, 3> reduced;
    for (size_t axis = 0; axis < 3; ++axis) {
        left.row(static_cast<Eigen::Index>(axis)) -= (seen_.slope[axis] * found.motion).transpose();
        reduced[axis] = reduce(seen_, axis);
    }
    double largest = 1;
    for (Eigen::Index i = 0; i < seen_.places(); ++i) {
        Eigen::Matrix3d unexplained = noise[i] * Eigen::Matrix3d::Identity();
        for (size_t a = 0; a < 3; ++a)
            for (size_t b = 0; b < 3; ++b)
                unexplained(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)) -=
                    reduced[a].col(i).dot(reduced[b].col(i));
        const double raise =
            std::max(1.0, left.col(i).dot(unexplained.inverse() * left.col(i)) / 3);
        noise[i] *= raise;
        largest = std::max(largest, raise);
    }
    return largest;
}

Eigen::VectorXd UnseenKriging::variances(const DisplacementModel& of) const {
    Eigen::VectorXd sums = Eigen::VectorXd::Zero(of.places());
    for (size_t axis = 0; axis < 3; ++axis)
        sums += reduce(of, axis).colwise().squaredNorm().transpose();
    return sums;
}

Eigen::MatrixXd UnseenKriging::covariance() const {
    return product_with_itself(reducer_.leftCols(information_.cols()));
}

}  // namespace defrec
