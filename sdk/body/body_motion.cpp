// See body_motion.hpp.
#include "sdk/body/body_motion.hpp"

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "sdk/base/os/services.hpp"
#include "sdk/body/decisions.hpp"
#include "sdk/body/deep_motion.hpp"

namespace defrec {
namespace {

using decisions::BodyEvidence;
using Decision = decisions::DeepMotion;

using Vectors = Eigen::Matrix3Xd;

// The handles as a frame shows them: means of their vertices, each with its evidence, so that
// vertices that are not known take no part.
struct HandlesNow {
    Vectors rest, now;
    Eigen::VectorXd evidence, error_mm2;

    HandlesNow(const BodyPiece& piece, const SurfaceNow& surface) {
        const auto count = static_cast<Eigen::Index>(piece.handles().size());
        rest.setZero(3, count);
        now.setZero(3, count);
        evidence.setZero(count);
        error_mm2.setZero(count);
        std::vector<double> shares;
        for (Eigen::Index i = 0; i < count; ++i) {
            const Handle& handle = piece.handles()[static_cast<size_t>(i)];
            shares.clear();
            double sum = 0;
            for (const uint32_t vertex : handle.vertices)
                sum += shares.emplace_back(known_share(surface, vertex));
            for (size_t k = 0; k < handle.vertices.size(); ++k) {
                const uint32_t vertex = handle.vertices[k];
                const double known = shares[k],
                             error = static_cast<double>(surface.expected_error[vertex]),
                             weight = sum > 0 ? known / sum
                                              : 1 / static_cast<double>(handle.vertices.size());
                rest.col(i) += weight * handle.places[k].cast<double>();
                now.col(i) +=
                    weight * Eigen::Map<const Eigen::Vector3f>(&surface.positions[3 * vertex])
                                 .cast<double>();
                evidence[i] += weight * known;
                error_mm2[i] += weight * error * error;
            }
        }
    }

  private:
    // Evidence below the least counts as none: a place that is anywhere would pull with it.
    static double known_share(const SurfaceNow& surface, uint32_t vertex) {
        constexpr double kLeast = BodyEvidence::kMin;
        const double evidence = evidence_of(static_cast<double>(surface.expected_error[vertex]));
        return std::max(0.0, (evidence - kLeast) / (1 - kLeast));
    }
};

// Displacements of the handles in a frame of reference, three rows for each.
Eigen::VectorXf displacements(const HandlesNow& handles, const Eigen::Isometry3d& frame) {
    const Eigen::Matrix3Xf back = (frame.inverse() * handles.now - handles.rest).cast<float>();
    return Eigen::Map<const Eigen::VectorXf>(back.data(), back.size());
}

// The body's own answer takes the place of data in doubt: what is given to a handle then pulls with
// its share of evidence alone.
class DoubtfulData {
  public:
    DoubtfulData(const BodyPiece& piece, const Eigen::VectorXd& evidence) : piece_(piece) {
        for (Eigen::Index i = 0; i < evidence.size(); ++i)
            if (evidence[i] < BodyEvidence::kFull)
                for (int axis = 0; axis < 3; ++axis) {
                    rows_.push_back(3 * i + axis);
                    doubt_.push_back(static_cast<float>(1 - evidence[i]));
                }
        if (rows_.empty()) return;
        const auto count = static_cast<Eigen::Index>(rows_.size());
        // Divided by the doubt, so that it is symmetric as the response is, and positive definite.
        Eigen::MatrixXf system(count, count);
        for (Eigen::Index column = 0; column < count; ++column) {
            for (Eigen::Index row = 0; row < count; ++row)
                system(row, column) = -piece.handle_response()(rows_[static_cast<size_t>(row)],
                                                               rows_[static_cast<size_t>(column)]);
            system(column, column) += 1 / doubt_[static_cast<size_t>(column)];
        }
        solver_.compute(system);
        if (solver_.info() != Eigen::Success) rows_.clear();
    }
    // data: a column for each set of displacements of the handles.
    template <class Data>
    void replace(Data& data) const {
        if (rows_.empty()) return;
        Data known = data;
        for (const Eigen::Index row : rows_) known.row(row).setZero();
        Eigen::MatrixXf right(static_cast<Eigen::Index>(rows_.size()), data.cols());
        // The response is symmetric; its columns lie in memory as they are read.
        for (size_t k = 0; k < rows_.size(); ++k)
            right.row(static_cast<Eigen::Index>(k)) =
                (1 / doubt_[k] - 1) * data.row(rows_[k]) +
                piece_.handle_response().col(rows_[k]).transpose() * known;
        const Eigen::MatrixXf solved = solver_.solve(right);
        for (size_t k = 0; k < rows_.size(); ++k)
            data.row(rows_[k]) = solved.row(static_cast<Eigen::Index>(k));
    }

    bool empty() const { return rows_.empty(); }

  private:
    const BodyPiece& piece_;
    std::vector<Eigen::Index> rows_;
    std::vector<float> doubt_;
    Eigen::LLT<Eigen::MatrixXf> solver_;
};

Eigen::VectorXf unfollowed(const BodyPiece& piece, const Eigen::VectorXf& data) {
    return data - piece.handle_response() * data;
}

// How a rigid motion changes what the handles' springs give way.
MotionSlope force_slope(const BodyPiece& piece, const DoubtfulData& doubtful) {
    if (doubtful.empty()) return piece.force_slope();
    Eigen::MatrixXf filled = piece.handle_slope();
    doubtful.replace(filled);
    return (filled - piece.handle_response() * filled).cast<double>();
}

Eigen::Isometry3d find_deep_motion(const BodyPiece& piece, const HandlesNow& handles,
                                   const DoubtfulData& doubtful, const Eigen::Isometry3d& start,
                                   const std::optional<Eigen::Isometry3d>& expected) {
    std::array<HandleResiduals, 2> kinds;
    auto& [forces, displaced] = kinds;
    displaced.slope = motion_slope(handles.rest);
    displaced.floor = Decision::kNoise;
    forces.slope = force_slope(piece, doubtful);
    forces.floor = Decision::kForceFloor;
    Eigen::Isometry3d motion = start;
    for (int round = 0; round < 3; ++round) {
        Eigen::VectorXf data = displacements(handles, motion);
        displaced.values = data.cast<double>();
        if (round == 0) {
            const double size =
                median_size(displaced.values, handles.evidence) / Decision::kDeformed;
            displaced.share = 1 / (1 + std::pow(size, 6));
        }
        doubtful.replace(data);
        forces.values = unfollowed(piece, data).cast<double>();
        const Eigen::Vector3d centre = handles.rest.rowwise().mean();
        const SmallMotion step =
            sparsest(kinds, handles.evidence,
                     expected ? camera_prior(motion, *expected, centre) : MotionPrior{});
        motion = motion * as_motion(step);
        if (step.tail<3>().norm() < Decision::kLargeTurn) break;
    }
    return motion;
}

struct HandleMeasure {
    Eigen::Vector3f moved;     // mm, against what lies deep
    Eigen::Vector3f strained;  // mm, against the frame that the body is strained in
    float error_mm2, evidence;
};

struct Choices {
    Eigen::Isometry3d deep, robust, mean;
    bool is_held;
    // Elasticity is linear in a frame that turns with the surface; supports are displaced in it.
    const Eigen::Isometry3d& frame() const { return mean; }
    Eigen::Matrix<float, 12, 1> support() const {
        const Eigen::Isometry3d back = frame().inverse() * deep;
        Eigen::Matrix<double, 3, 4, Eigen::RowMajor> affine = back.matrix().topRows<3>();
        affine.leftCols<3>() -= Eigen::Matrix3d::Identity();
        return Eigen::Map<const Eigen::Matrix<double, 12, 1>>(affine.data()).cast<float>();
    }
};

using NodeNow = Eigen::Matrix<float, 8, 1>;

NodeNow move_node(const BodyPiece& piece, size_t node, std::span<const HandleMeasure> handles,
                  const Choices& choices, const Eigen::Matrix<float, 12, 1>& support) {
    Eigen::Vector3f moved = piece.support_response().middleRows<3>(
                                3 * static_cast<Eigen::Index>(node)) *
                            support,
                    shift = Eigen::Vector3f::Zero();
    constexpr float kLeastWeight = 1e-3f;
    float error = 0, square = 0, evidence = 0;
    for (const BodyPiece::Link& link : piece.links(node)) {
        const HandleMeasure& handle = handles[static_cast<size_t>(link.handle)];
        moved += link.response * handle.strained;
        shift += link.influence * handle.moved;
        square += link.influence * handle.moved.squaredNorm();
        error += link.influence * (handle.evidence + kLeastWeight) * handle.error_mm2;
        evidence += link.influence * handle.evidence;
    }
    const Eigen::Vector3d rest = piece.lattice().nodes()[node];
    const double share = static_cast<double>(piece.support_share(node)),
                 choice =
                     choices.is_held
                         ? 0
                         : share * share *
                               std::max((choices.deep * rest - choices.robust * rest).squaredNorm(),
                                        (choices.deep * rest - choices.mean * rest).squaredNorm());
    NodeNow now;
    now << (choices.frame() * (rest + moved.cast<double>())).cast<float>(),
        error / (evidence + kLeastWeight), std::max(0.0f, square - shift.squaredNorm()),
        shift.squaredNorm(), static_cast<float>(choice), evidence;
    return now;
}

}  // namespace

double evidence_of(double error_mm) {
    constexpr double kErrorOfHalf = BodyEvidence::kErrorOfHalf;
    const double relative = error_mm * error_mm / (kErrorOfHalf * kErrorOfHalf);
    return 1 / (1 + relative * relative);
}

BodyMotion::BodyMotion(std::shared_ptr<const Body> body, const SurfaceNow& surface,
                       const DeepKnowledge& known, const Services* helpers)
    : body_(std::move(body)) {
    for (const BodyPiece& piece : body_->pieces())
        pieces_.push_back(move_piece(piece, surface, known, helpers));
}

BodyMotion::Piece BodyMotion::move_piece(const BodyPiece& piece, const SurfaceNow& surface,
                                         const DeepKnowledge& known, const Services* helpers) {
    Piece made;
    HandlesNow handles(piece, surface);
    const Eigen::VectorXd told = handles.evidence;
    // The surface stays where it was while nothing is known.
    if (!(told.sum() > 0)) handles.evidence.setOnes();
    const DoubtfulData doubtful(piece, handles.evidence);
    const Eigen::Isometry3d mean = fit_rigid(handles.rest, handles.now, handles.evidence),
                            robust = fit_rigid_robust(handles.rest, handles.now, handles.evidence,
                                                      Decision::kFloor);
    made.deep = known.held ? *known.held
                : handles.evidence.sum() < Decision::kMinEvidence
                    ? mean
                    : find_deep_motion(piece, handles, doubtful, robust, known.expected);
    Eigen::VectorXf data = displacements(handles, made.deep);
    doubtful.replace(data);
    const Eigen::VectorXf left = unfollowed(piece, data);
    const Eigen::Matrix3f turn = made.deep.linear().cast<float>();
    const auto count = static_cast<Eigen::Index>(piece.handles().size());
    made.left.resize(3, count);
    std::vector<HandleMeasure> measures(static_cast<size_t>(count));
    const Choices choices{made.deep, robust, mean, known.held.has_value()};
    const Eigen::Isometry3d to_frame = choices.frame().inverse() * made.deep;
    for (Eigen::Index i = 0; i < count; ++i) {
        const auto evidence = static_cast<float>(told[i]);
        const Eigen::Vector3f moved = data.segment<3>(3 * i);
        made.left.col(i) =
            static_cast<float>(handles.evidence[i]) * (turn * left.segment<3>(3 * i));
        const Eigen::Vector3d rest = handles.rest.col(i);
        const Eigen::Vector3d strained = to_frame * (rest + moved.cast<double>()) - rest;
        measures[static_cast<size_t>(i)] = {moved, strained.cast<float>(),
                                            static_cast<float>(handles.error_mm2[i]), evidence};
        made.activity_mm2 += handles.evidence[i] * static_cast<double>(moved.squaredNorm());
    }
    made.activity_mm2 /= std::max(handles.evidence.sum(), 1e-3);
    const size_t nodes = piece.lattice().free_nodes();
    std::vector<NodeNow> free(nodes);
    constexpr size_t kRun = 64;
    const Eigen::Matrix<float, 12, 1> support = choices.support();
    const auto move_run = [&](size_t run) {
        for (size_t node = run * kRun; node < std::min(nodes, (run + 1) * kRun); ++node)
            free[node] = move_node(piece, node, measures, choices, support);
    };
    const size_t runs = (nodes + kRun - 1) / kRun;
    if (helpers != nullptr)
        helpers->parallel_for(runs, move_run);
    else
        for (size_t run = 0; run < runs; ++run) move_run(run);
    const size_t all = piece.lattice().nodes().size();
    made.nodes.assign(all, NodeNow::Zero());
    for (size_t i = 0; i < all; ++i)
        for (const Lattice::Term& term : piece.lattice().terms(i))
            made.nodes[i] += static_cast<float>(term.weight) * free[static_cast<size_t>(term.node)];
    return made;
}

BodyMotion::Moved BodyMotion::move(const BodyPoint& point, const Eigen::Vector3d& at_rest) const {
    const Piece& piece = pieces_[point.piece];
    const BodyPiece& made = body_->pieces()[point.piece];
    if (point.place.cell < 0) return {piece.deep * at_rest};
    const Lattice::Cell& cell = made.lattice().cells()[static_cast<size_t>(point.place.cell)];
    const std::array<double, 8> weights = point.place.weights();
    NodeNow now = NodeNow::Zero();
    for (size_t k = 0; k < 8; ++k)
        now += static_cast<float>(weights[k]) * piece.nodes[static_cast<size_t>(cell.node[k])];
    Eigen::Vector3d place = now.head<3>().cast<double>();
    if (point.beyond_mm > 0)
        place += piece.deep.linear() * (at_rest - made.lattice().position(point.place));
    // Details that the lattice is too coarse for fade within a cell.
    const double fade = std::exp(-std::abs(point.depth_mm) / made.lattice().step());
    for (size_t k = 0; k < BodyPoint::kHandles; ++k)
        place += fade * point.weight[k] * piece.left.col(point.handle[k]).cast<double>();
    return {place, now[3], now[4], now[5], now[6], now[7], piece.activity_mm2};
}

}  // namespace defrec
