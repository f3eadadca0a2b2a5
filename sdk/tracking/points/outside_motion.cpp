// See outside_motion.hpp.
#include "sdk/tracking/points/outside_motion.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "backends/shared/motion.hpp"
#include "sdk/body/deep_motion.hpp"
#include "sdk/tracking/frame/decisions.hpp"

namespace defrec {
namespace {

using Decision = decisions::OutsideMotion;

constexpr double kJitter = 1e-6;

Eigen::Vector3d as_vector(const float* xyz) {
    return Eigen::Map<const Eigen::Vector3f>(xyz).cast<double>();
}

// Each number times the identity of three axes.
Eigen::MatrixXd on_axes(const Eigen::MatrixXd& values) {
    Eigen::MatrixXd all = Eigen::MatrixXd::Zero(3 * values.rows(), 3 * values.cols());
    for (Eigen::Index row = 0; row < values.rows(); ++row)
        for (Eigen::Index column = 0; column < values.cols(); ++column)
            all.block<3, 3>(3 * row, 3 * column).diagonal().setConstant(values(row, column));
    return all;
}

Eigen::Map<const Eigen::VectorXd> as_column(const Eigen::Matrix3Xd& values) {
    return {values.data(), values.size()};
}

using Matrix6 = Eigen::Matrix<double, 6, 6>;

// Errors of neighbouring vertices are alike: a mean of many is no better than each.
double noise_mm2(double error_mm2) {
    return Decision::kNoise * Decision::kNoise + Decision::kErrorShare * error_mm2;
}

Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& signal, const Eigen::VectorXd& noise) {
    Eigen::MatrixXd sum = signal;
    sum.diagonal() += noise;
    return sum.llt().solve(Eigen::MatrixXd::Identity(sum.rows(), sum.cols()));
}

defrec_motion as_motion_record(const Eigen::Matrix3d& turn, const Eigen::Vector3d& shift) {
    const Eigen::Quaterniond q(turn);
    return from_rigid(Quaternion<double>{q.w(), q.x(), q.y(), q.z()},
                      {shift.x(), shift.y(), shift.z()})
        .store();
}

// A cell that the others foretell otherwise is taken for as noisy as it seems.
void raise_noise(const Eigen::MatrixXd& signal, const MotionSlope& slope,
                 const Eigen::VectorXd& values, Eigen::VectorXd& noise) {
    const Eigen::Index cells = values.size() / 3;
    for (int round = 0; round < 2; ++round) {
        const Eigen::MatrixXd inverse = inverse_of(signal, noise);
        const MotionSlope weighed = inverse * slope;
        const Matrix6 of_motion = (slope.transpose() * weighed).inverse();
        const Eigen::VectorXd foretold =
            inverse * values - weighed * (of_motion * (weighed.transpose() * values));
        for (Eigen::Index i = 0; i < cells; ++i) {
            const auto rows = weighed.middleRows<3>(3 * i);
            const Eigen::Matrix3d block =
                inverse.block<3, 3>(3 * i, 3 * i) - rows * of_motion * rows.transpose();
            const Eigen::Vector3d own = foretold.segment<3>(3 * i);
            noise.segment<3>(3 * i) *= std::max(1.0, own.dot(block.inverse() * own) / 3);
        }
    }
}

}  // namespace

OutsidePiece::OutsidePiece(const Template& surface, size_t piece)
    : cells_(surface, piece), length_mm_(Decision::kLengthShare * cells_.view_width_mm()) {
    const Eigen::Index count = cells_.rest().cols();
    own_kernel_ = kernel(cells_.rest(), cells_.rest());
    own_kernel_.diagonal().array() += kJitter;
    factor_.compute(own_kernel_);
    products_.setZero(3 * count, 3 * count);
    variance_.assign(cells_.size(), 0);
}

void OutsidePiece::learn_from(const OutsidePiece& before) {
    if (before.cells_.size() == 0 || cells_.size() == 0) return;
    const Eigen::MatrixXd across = before.weights(cells_.rest()), spread = on_axes(across);
    const Eigen::MatrixXd left =
        own_kernel_ - across * before.kernel(before.cells_.rest(), cells_.rest());
    products_ = spread * before.products_ * spread.transpose() +
                before.frames_ * Decision::kStart * Decision::kStart * on_axes(left);
    frames_ = before.frames_;
    cells_.take_ages(before.cells_);
    all_frames_ = before.all_frames_;
}

// Matern's covariance of order 3/2.
Eigen::MatrixXd OutsidePiece::kernel(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) const {
    Eigen::MatrixXd values(a.cols(), b.cols());
    for (Eigen::Index i = 0; i < a.cols(); ++i)
        for (Eigen::Index j = 0; j < b.cols(); ++j) {
            const double distance = std::sqrt(3.0) * (a.col(i) - b.col(j)).norm() / length_mm_;
            values(i, j) = (1 + distance) * std::exp(-distance);
        }
    return values;
}

Eigen::MatrixXd OutsidePiece::weights(const Eigen::Matrix3Xd& places) const {
    return factor_.solve(kernel(cells_.rest(), places)).transpose();
}

bool OutsidePiece::add_frame(const Seen& seen) {
    if (!cells_.read(seen.samples, seen.confidence)) return false;
    ++all_frames_;
    if (seen.is_apart) return solve();
    if (cells_.seen().rest.cols() == cells_.rest().cols())
        learn_directly();
    else if (all_frames_ % Decision::kLearnEvery == 0)
        solve();
    return false;
}

void OutsidePiece::learn(const Eigen::VectorXd& displacements) {
    products_ *= Decision::kForget;
    products_.noalias() += displacements * displacements.transpose();
    frames_ = Decision::kForget * frames_ + 1;
}

// Kriging gives what is seen where every cell is.
void OutsidePiece::learn_directly() {
    const OutsideCells::Seen& seen = cells_.seen();
    const Eigen::Isometry3d pose =
        fit_rigid(seen.rest, seen.now, Eigen::VectorXd::Ones(seen.rest.cols()));
    const Eigen::Matrix3Xd displacements = pose.inverse() * seen.now - seen.rest;
    learn(as_column(displacements));
    for (Eigen::Index i = 0; i < seen.rest.cols(); ++i)
        products_.diagonal().segment<3>(3 * i).array() += noise_mm2(seen.error_mm2[i]);
}

// false: the numbers do not do.
bool OutsidePiece::solve() {
    const OutsideCells::Seen& seen = cells_.seen();
    const Eigen::Index used = seen.rest.cols();
    const Eigen::MatrixXd covariance = (Decision::kStartFrames * Decision::kStart *
                                            Decision::kStart * on_axes(own_kernel_) +
                                        products_) /
                                       (Decision::kStartFrames + frames_),
                          across = weights(seen.rest), spread = on_axes(across),
                          to_cells = covariance * spread.transpose(), signal = spread * to_cells;
    // Means of parts of cells lie off the cells' means.
    const Eigen::VectorXd left =
        (1 - (across * own_kernel_).cwiseProduct(across).rowwise().sum().array()).max(0.0).matrix();
    Eigen::VectorXd noise(3 * used);
    for (Eigen::Index i = 0; i < used; ++i)
        noise.segment<3>(3 * i).setConstant(Decision::kStart * Decision::kStart * left[i] +
                                            noise_mm2(seen.error_mm2[i]));

    pose_ = fit_rigid(seen.rest, seen.now, Eigen::VectorXd::Ones(used));
    const Eigen::Vector3d centre = seen.rest.rowwise().mean();
    const MotionSlope slope = motion_slope(seen.rest.colwise() - centre);
    const auto displacements = [&]() -> Eigen::VectorXd {
        const Eigen::Matrix3Xd values = pose_.inverse() * seen.now - seen.rest;
        return as_column(values);
    };
    Eigen::VectorXd values = displacements();
    raise_noise(signal, slope, values, noise);
    const Eigen::MatrixXd inverse = inverse_of(signal, noise);
    const Matrix6 of_motion = (slope.transpose() * inverse * slope).inverse();
    for (int round = 0; round < 2; ++round) {
        const SmallMotion step = of_motion * (slope.transpose() * (inverse * values));
        pose_ =
            pose_ * Eigen::Translation3d(centre) * as_motion(step) * Eigen::Translation3d(-centre);
        values = displacements();
    }
    const Eigen::MatrixXd gain = to_cells * inverse;
    const Eigen::VectorXd found = gain * values;
    const MotionSlope of_pose = gain * slope;
    const Eigen::MatrixXd doubt = covariance - gain * to_cells.transpose();
    const Eigen::Map<const Eigen::Matrix3Xd> at_cells(found.data(), 3, cells_.rest().cols());
    smooth_ = factor_.solve(at_cells.transpose()).transpose();
    const MotionSlope lever = motion_slope(cells_.rest().colwise() - centre) - of_pose;
    for (Eigen::Index i = 0; i < cells_.rest().cols(); ++i) {
        const auto rows = lever.middleRows<3>(3 * i);
        variance_[static_cast<size_t>(i)] =
            Decision::kVarianceShare * (doubt.diagonal().segment<3>(3 * i).sum() +
                                        (rows * of_motion * rows.transpose()).trace()) +
            unseen_mm2(i);
    }
    const Eigen::MatrixXd uncertain = doubt + of_pose * of_motion * of_pose.transpose();
    if (!found.allFinite() || !uncertain.allFinite()) return false;
    learn(found);
    products_ += uncertain;
    return true;
}

// Variance of motion that a cell has for itself: since it was seen, and far from what is seen.
double OutsidePiece::unseen_mm2(Eigen::Index cell) const {
    const Eigen::Matrix3Xd& seen = cells_.seen().rest;
    const double nearest = (seen.colwise() - cells_.rest().col(cell)).colwise().norm().minCoeff(),
                 far = std::clamp((nearest - cells_.apart_mm() / 2) / Decision::kFar, 0.0, 1.0),
                 unseen = std::min(cells_.age(cell), Decision::kLong);
    return Decision::kMost * Decision::kMost * far * far * unseen / Decision::kLong;
}

Eigen::Vector3d OutsidePiece::place(const Eigen::Vector3d& at_rest) const {
    return pose_ * (at_rest + smooth_ * kernel(cells_.rest(), at_rest));
}

OutsideMotion::OutsideMotion(const Template& surface) {
    for (size_t piece = 0; piece < surface.data().pieces(); ++piece)
        pieces_.emplace_back(surface, piece);
}

OutsideMotion::OutsideMotion(const Template& surface, const OutsideMotion& before)
    : OutsideMotion(surface) {
    for (size_t piece = 0; piece < std::min(pieces_.size(), before.pieces_.size()); ++piece)
        pieces_[piece].learn_from(before.pieces_[piece]);
}

// Finds what each control point moves, and the pieces with some that move nothing in the image.
void OutsideMotion::find_moves(const TemplateData& data, SurfaceSamples samples) {
    for (size_t i = 0; i < samples.size(); ++i) {
        const Moves moves =
            samples[i].observation == DEFREC_OUTSIDE ? Moves::kOutside : Moves::kSeen;
        for (size_t k = 0; k < DEFREC_BLEND_NODES; ++k) {
            if (!(data.vertices[i].weight[k] > 0)) continue;
            Moves& of_node = moves_[static_cast<size_t>(data.vertices[i].node[k])];
            of_node = std::max(of_node, moves);
        }
    }
    for (size_t node = 0; node < moves_.size(); ++node)
        if (moves_[node] == Moves::kOutside) is_apart_[data.piece_of_node(node)] = 1;
}

bool OutsideMotion::add_frame(const Template& surface, SurfaceSamples samples, bool any_outside,
                              std::span<const defrec_piece> pieces, const Results& results) {
    moves_.assign(results.motions.size(), Moves::kNothing);
    is_apart_.assign(pieces_.size(), 0);
    if (any_outside) find_moves(surface.data(), samples);
    bool is_changed = false;
    for (size_t piece = 0; piece < pieces_.size(); ++piece) {
        const bool is_lost = pieces[piece].state == DEFREC_LOST;
        if (is_lost) pieces_[piece].add_lost_frame();
        const bool is_told = !is_lost && pieces_[piece].add_frame(
                                             {samples, results.confidence, is_apart_[piece] != 0});
        is_apart_[piece] = is_told ? 1 : 0;
        is_changed |= is_told;
    }
    if (is_changed) move_outside(surface, results);
    return is_changed;
}

void OutsideMotion::move_outside(const Template& surface, const Results& results) const {
    const TemplateData& data = surface.data();
    for (size_t node = 0; node < moves_.size(); ++node) {
        const uint8_t piece = data.piece_of_node(node);
        if (moves_[node] != Moves::kOutside || is_apart_[piece] == 0) continue;
        const Eigen::Vector3d rest = as_vector(&data.nodes[3 * node]);
        const Eigen::Matrix3d turn = pieces_[piece].rotation();
        results.motions[node] = as_motion_record(turn, pieces_[piece].place(rest) - turn * rest);
    }
    for (size_t i = 0; i < data.vertices.size(); ++i) {
        const defrec_surface_point& vertex = data.vertices[i];
        const uint8_t piece = surface.vertex_pieces()[i];
        if (is_apart_[piece] == 0) continue;
        double share = 0;  // of what moves it
        for (size_t k = 0; k < DEFREC_BLEND_NODES; ++k)
            if (moves_[static_cast<size_t>(vertex.node[k])] == Moves::kOutside)
                share += static_cast<double>(vertex.weight[k]);
        if (share <= 0) continue;
        const auto motion = blend<double>(results.motions.data(), vertex.node, vertex.weight);
        store3(apply(motion, load3<double>(vertex.position)), &results.vertices[3 * i]);
        store3(rotate(motion, load3<double>(vertex.normal)), &results.normals[3 * i]);
        float* covariance = &results.confidence.covariance[6 * i];
        const double variance = pieces_[piece].variance_mm2(i);
        for (size_t k = 0; k < 6; ++k)
            covariance[k] =
                static_cast<float>((1 - share) * static_cast<double>(covariance[k]) +
                                   (k == 0 || k == 3 || k == 5 ? share * variance / 3 : 0.0));
        results.confidence.expected_error[i] =
            std::sqrt(covariance[0] + covariance[3] + covariance[5]);
    }
}

}  // namespace defrec
