// See unseen_kriging.hpp.
#include "sdk/tracking/points/unseen_kriging.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <limits>

namespace defrec {
namespace {

using Indices = Eigen::Array<Eigen::Index, Eigen::Dynamic, 1>;

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

// The factor's upper triangle is 0. NaN where there is no factor.
Eigen::MatrixXd inverse_of_factor(const Eigen::MatrixXd& symmetric) {
    const Eigen::LLT<Eigen::MatrixXd> parts(symmetric);
    Eigen::MatrixXd factor = parts.matrixL();
    if (parts.info() == Eigen::Success)
        invert_lower(factor);
    else
        factor.setConstant(std::numeric_limits<double>::quiet_NaN());
    return factor;
}

// A quasi-definite matrix as unit lower triangle, diagonal, triangle transposed. Such a matrix
// needs no pivoting (Vanderbei, Symmetric quasidefinite matrices, 1995).
struct TriangleAndPivots {
    Eigen::MatrixXd triangle;
    Eigen::VectorXd pivots;
};
TriangleAndPivots factor_quasi_definite(const Eigen::MatrixXd& symmetric) {
    const Eigen::Index rows = symmetric.rows();
    TriangleAndPivots found{Eigen::MatrixXd::Identity(rows, rows), Eigen::VectorXd(rows)};
    for (Eigen::Index j = 0; j < rows; ++j) {
        const Eigen::Index below = rows - j;
        Eigen::VectorXd column = symmetric.col(j).tail(below);
        column.noalias() -=
            found.triangle.block(j, 0, below, j) *
            found.pivots.head(j).cwiseProduct(found.triangle.row(j).head(j).transpose());
        found.pivots[j] = column[0];
        found.triangle.col(j).tail(below - 1) = column.tail(below - 1) / column[0];
    }
    return found;
}

Eigen::MatrixXd product_with_itself(const Eigen::MatrixXd& factor) {
    Eigen::MatrixXd product = Eigen::MatrixXd::Zero(factor.cols(), factor.cols());
    product.selfadjointView<Eigen::Lower>().rankUpdate(factor.transpose());
    product.triangularView<Eigen::StrictlyUpper>() = product.transpose();
    return product;
}

// foretold: covariance of the displacement that is found at a place of this weight.
Eigen::Matrix3d doubt(double weight, const Eigen::Matrix3d& foretold) {
    if (weight <= 0) return Eigen::Matrix3d::Zero();
    return (Eigen::Matrix3d::Identity() / weight - foretold).inverse();
}

}  // namespace

DisplacementModel::DisplacementModel(Eigen::MatrixXd shapes_of_modes,
                                     const Eigen::Matrix3Xd& from_centre)
    : shapes(std::move(shapes_of_modes)) {
    const MotionSlope all = motion_slope(from_centre);
    for (Eigen::Index axis = 0; axis < 3; ++axis)
        slope[static_cast<size_t>(axis)] = all(Eigen::seqN(axis, places(), 3), Eigen::all);
}

DisplacementModel DisplacementModel::part(std::span<const Eigen::Index> places) const {
    DisplacementModel part;
    part.shapes = shapes(places, Eigen::all);
    for (size_t axis = 0; axis < 3; ++axis) part.slope[axis] = slope[axis](places, Eigen::all);
    return part;
}

Eigen::MatrixXd DisplacementModel::times(size_t axis, const Eigen::MatrixXd& matrix) const {
    Eigen::MatrixXd product = slope[axis] * matrix.bottomRows<6>();
    product.noalias() +=
        shapes * matrix.middleRows(static_cast<Eigen::Index>(axis) * modes(), modes());
    return product;
}

void add_on_axes(const Eigen::MatrixXd& values, Eigen::MatrixXd& sum) {
    for (Eigen::Index axis = 0; axis < 3; ++axis)
        sum.block(axis * values.rows(), axis * values.cols(), values.rows(), values.cols()) +=
            values;
}

Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& symmetric) {
    return product_with_itself(inverse_of_factor(symmetric));
}

void UnseenKriging::weigh(const Eigen::VectorXd& weight) {
    weight_ = weight;
    change_.reset();
    doubts_.resize(3, 0);
    const Eigen::Index modes = of_.modes(), all = 3 * modes + 6;
    const Eigen::MatrixXd weighed = weight_.asDiagonal() * of_.shapes;
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(all, all);
    information.topLeftCorner(3 * modes, 3 * modes) = information_;
    add_on_axes(of_.shapes.transpose() * weighed, information);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
        const MotionSlope& slope = of_.slope[static_cast<size_t>(axis)];
        // The lower triangle is read.
        information.block(3 * modes, axis * modes, 6, modes) = slope.transpose() * weighed;
        information.bottomRightCorner<6, 6>() += slope.transpose() * weight_.asDiagonal() * slope;
    }
    reducer_ = inverse_of_factor(information);
}

UnseenKriging::Found UnseenKriging::solve(const Eigen::Matrix3Xd& displacements) const {
    const Eigen::Index modes = of_.modes();
    Eigen::VectorXd sums = Eigen::VectorXd::Zero(reducer_.rows());
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
        const Eigen::VectorXd weighed = weight_.cwiseProduct(displacements.row(axis).transpose());
        sums.segment(axis * modes, modes) = of_.shapes.transpose() * weighed;
        sums.tail<6>() += of_.slope[static_cast<size_t>(axis)].transpose() * weighed;
    }
    const Eigen::VectorXd reduced = reducer_ * sums;
    Eigen::VectorXd found = reducer_.transpose() * reduced;
    if (change_) {
        const Eigen::VectorXd parts =
            (change_->root.transpose() * sums).cwiseQuotient(change_->pivots);
        found -= change_->root * parts;
    }
    return {found.head(3 * modes).reshaped(modes, 3), found.tail<6>()};
}

// The reducer times the model of places along an axis, a column for each place.
Eigen::MatrixXd UnseenKriging::reduce(const DisplacementModel& of, size_t axis) const {
    const Eigen::Index modes = of.modes(), above = static_cast<Eigen::Index>(axis) * modes,
                       below = reducer_.rows() - above;
    Eigen::MatrixXd reduced(reducer_.rows(), of.places());
    if (of.places() == 0) return reduced;  // has no memory that a block could begin in
    reduced.topRows(above).setZero();
    reduced.bottomRows(below).noalias() =
        reducer_.block(above, above, below, modes) * of.shapes.transpose();
    reduced.bottomRows<6>() += reducer_.bottomRightCorner<6, 6>() * of.slope[axis].transpose();
    return reduced;
}

void UnseenKriging::find_doubts() {
    if (doubts_.cols() > 0) return;
    doubts_.setZero(3, 3 * of_.places());
    Indices known(of_.places());
    Eigen::Index count = 0;
    for (Eigen::Index i = 0; i < of_.places(); ++i)
        if (weight_[i] > 0) known[count++] = i;
    const DisplacementModel of = of_.part({known.data(), static_cast<size_t>(count)});
    std::array<Eigen::MatrixXd, 3> reduced;
    for (size_t axis = 0; axis < 3; ++axis) reduced[axis] = reduce(of, axis);
    for (Eigen::Index i = 0; i < of.places(); ++i) {
        Eigen::Matrix3d foretold;
        for (size_t a = 0; a < 3; ++a)
            for (size_t b = 0; b < 3; ++b)
                foretold(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)) =
                    reduced[a].col(i).dot(reduced[b].col(i));
        const Eigen::Index place = known[i];
        doubts_.middleCols<3>(3 * place) = doubt(weight_[place], foretold);
    }
}

Eigen::VectorXd UnseenKriging::surprises(const Eigen::Matrix3Xd& displacements,
                                         const Found& found) const {
    Eigen::Matrix3Xd left = displacements - (of_.shapes * found.coefficients).transpose();
    for (Eigen::Index axis = 0; axis < 3; ++axis)
        left.row(axis) -= (of_.slope[static_cast<size_t>(axis)] * found.motion).transpose();
    Eigen::VectorXd values(of_.places());
    for (Eigen::Index i = 0; i < values.size(); ++i)
        values[i] = left.col(i).dot(doubts_.middleCols<3>(3 * i) * left.col(i)) / 3;
    return values;
}

Eigen::VectorXd UnseenKriging::variances(const DisplacementModel& of) const {
    Eigen::VectorXd sums = Eigen::VectorXd::Zero(of.places());
    for (size_t axis = 0; axis < 3; ++axis)
        sums += reduce(of, axis).colwise().squaredNorm().transpose();
    return sums;
}

Eigen::VectorXd UnseenKriging::lessened(const DisplacementModel& of) const {
    Eigen::VectorXd sums = Eigen::VectorXd::Zero(of.places());
    if (!change_) return sums;
    const Eigen::VectorXd share = change_->pivots.cwiseInverse();
    for (size_t axis = 0; axis < 3; ++axis)
        sums += of.times(axis, change_->root).cwiseAbs2() * share;
    return sums;
}

void UnseenKriging::find_covariance() { covariance_ = product_with_itself(reducer_); }

void UnseenKriging::change(std::span<const Eigen::Index> places, const Eigen::VectorXd& weight) {
    change_.reset();
    const auto count = static_cast<Eigen::Index>(places.size());
    if (count == 0) return;
    const DisplacementModel of = of_.part(places);
    const Eigen::VectorXd now = weight(places), step = now - weight_(places);
    weight_(places) = now;
    Eigen::MatrixXd product(covariance_.rows(), 3 * count);
    for (Eigen::Index axis = 0; axis < 3; ++axis)
        product.middleCols(axis * count, count) =
            of.times(static_cast<size_t>(axis), covariance_).transpose();
    // Covariance of what is found there, and what a step is worth. Less weight makes it negative
    // definite there, for what is found is known better than what was observed.
    Eigen::MatrixXd sum(3 * count, 3 * count);
    for (Eigen::Index axis = 0; axis < 3; ++axis)
        sum.middleRows(axis * count, count) = of.times(static_cast<size_t>(axis), product);
    sum.diagonal() += step.cwiseInverse().replicate<3, 1>();
    TriangleAndPivots parts = factor_quasi_definite(sum);
    invert_lower(parts.triangle);
    const Eigen::MatrixXd& inverse = parts.triangle;
    Change change;
    change.root.noalias() = product * inverse.transpose().triangularView<Eigen::UnitUpper>();
    change.pivots = parts.pivots;
    const Eigen::VectorXd share = parts.pivots.cwiseInverse();
    for (Eigen::Index k = 0; k < count; ++k) {
        const Eigen::MatrixX3d columns = inverse(Eigen::all, Eigen::seqN(k, 3, count));
        const Eigen::Matrix3d foretold =
            Eigen::Matrix3d::Identity() / step[k] -
            columns.transpose() * share.asDiagonal() * columns / (step[k] * step[k]);
        doubts_.middleCols<3>(3 * places[static_cast<size_t>(k)]) = doubt(now[k], foretold);
    }
    change_ = std::move(change);
}

Eigen::MatrixXd UnseenKriging::covariance() const {
    const Eigen::Index count = information_.cols();
    return covariance_.topLeftCorner(count, count);
}

}  // namespace defrec
