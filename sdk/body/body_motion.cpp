// See body_motion.hpp.
#include "sdk/body/body_motion.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "sdk/base/os/helped_loop.hpp"
#include "sdk/base/os/services.hpp"
#include "sdk/body/decisions.hpp"
#include "sdk/body/deep_motion.hpp"

namespace defrec {
namespace {

using decisions::BodyEvidence;
using Decision = decisions::DeepMotion;

using Vectors = Eigen::Matrix3Xd;

constexpr size_t kHandleRun = 16, kRowRun = 64, kNodeRun = 64;  // that a thread takes at a time

// The handles as a frame shows them: means of their vertices, each with its evidence, so that
// vertices that are not known take no part.
struct HandlesNow {
    Vectors rest, now;
    Eigen::VectorXd evidence, error_mm2;

    HandlesNow(const BodyPiece& piece, const SurfaceNow& surface, const Services* helpers) {
        const auto count = static_cast<Eigen::Index>(piece.handles().size());
        rest.setZero(3, count);
        now.setZero(3, count);
        evidence.setZero(count);
        error_mm2.setZero(count);
        helped_runs(helpers, piece.handles().size(), kHandleRun, [&](size_t begin, size_t end) {
            std::vector<double> shares;
            for (size_t i = begin; i < end; ++i) add(piece.handles()[i], i, surface, shares);
        });
    }

  private:
    // Evidence below the least counts as none: a place that is anywhere would pull with it.
    static double known_share(const SurfaceNow& surface, uint32_t vertex) {
        constexpr double kLeast = BodyEvidence::kMin;
        const double evidence = evidence_of(static_cast<double>(surface.expected_error[vertex]));
        return std::max(0.0, (evidence - kLeast) / (1 - kLeast));
    }
    // shares: working memory.
    void add(const Handle& handle, size_t index, const SurfaceNow& surface,
             std::vector<double>& shares) {
        const auto i = static_cast<Eigen::Index>(index);
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
                weight *
                Eigen::Map<const Eigen::Vector3f>(&surface.positions[3 * vertex]).cast<double>();
            evidence[i] += weight * known;
            error_mm2[i] += weight * error * error;
        }
    }
};

// Displacements of the handles in a frame of reference, three rows for each.
Eigen::VectorXf displacements(const HandlesNow& handles, const Eigen::Isometry3d& frame) {
    const Eigen::Matrix3Xf back = (frame.inverse() * handles.now - handles.rest).cast<float>();
    return Eigen::Map<const Eigen::VectorXf>(back.data(), back.size());
}

// The forces of the handles' springs for data: how far they give way.
Eigen::VectorXf forces_of(const BodyPiece& piece, const Eigen::VectorXf& data,
                          const Services* helpers) {
    const Eigen::MatrixXf& response = piece.force_response();
    Eigen::VectorXf forces(data.size());
    // The response is symmetric; its columns lie in memory as they are read.
    helped_runs(helpers, static_cast<size_t>(data.size()), kRowRun, [&](size_t begin, size_t end) {
        const auto first = static_cast<Eigen::Index>(begin),
                   count = static_cast<Eigen::Index>(end - begin);
        forces.segment(first, count).noalias() =
            response.middleCols(first, count).transpose() * data;
    });
    return forces;
}

// The body's own answer takes the place of data in doubt: what is given to a handle then pulls with
// its share of evidence alone, as by a spring in a row with the handle's own. In units of that one
// its stiffness is evidence / (1 - evidence).
class DoubtfulData {
  public:
    DoubtfulData(const BodyPiece& piece, const Eigen::VectorXd& evidence) : piece_(piece) {
        std::vector<float> stiffness;
        for (Eigen::Index i = 0; i < evidence.size(); ++i)
            if (evidence[i] < BodyEvidence::kFull)
                for (int axis = 0; axis < 3; ++axis) {
                    rows_.push_back(3 * i + axis);
                    stiffness.push_back(static_cast<float>(evidence[i] / (1 - evidence[i])));
                }
        if (rows_.empty()) return;
        Eigen::MatrixXf system = piece.force_response()(rows_, rows_);
        for (size_t k = 0; k < rows_.size(); ++k)
            system.diagonal()[static_cast<Eigen::Index>(k)] += stiffness[k];
        solver_.compute(system);
        if (solver_.info() != Eigen::Success) rows_.clear();
    }
    // forces: what the springs give way for data, a column for each set; then for what takes their
    // place. Returns by how much that differs from the data of the rows in doubt.
    template <class Forces>
    Forces replace(Forces& forces, const Services* helpers) const {
        Forces change(static_cast<Eigen::Index>(rows_.size()), forces.cols());
        if (rows_.empty()) return change;
        for (size_t k = 0; k < rows_.size(); ++k)
            change.row(static_cast<Eigen::Index>(k)) = -forces.row(rows_[k]);
        solver_.solveInPlace(change);
        const Eigen::MatrixXf& response = piece_.force_response();
        helped_runs(helpers, static_cast<size_t>(forces.rows()), kRowRun,
                    [&](size_t begin, size_t end) {
                        const auto first = static_cast<Eigen::Index>(begin),
                                   count = static_cast<Eigen::Index>(end - begin);
                        for (Eigen::Index set = 0; set < forces.cols(); ++set)
                            for (size_t k = 0; k < rows_.size(); ++k)
                                forces.col(set).segment(first, count) +=
                                    change(static_cast<Eigen::Index>(k), set) *
                                    response.col(rows_[k]).segment(first, count);
                    });
        return change;
    }
    // Rows of data in doubt, three for each handle.
    std::span<const Eigen::Index> rows() const { return rows_; }

  private:
    const BodyPiece& piece_;
    std::vector<Eigen::Index> rows_;
    Eigen::LLT<Eigen::MatrixXf> solver_;
};

Eigen::Isometry3d find_deep_motion(const BodyPiece& piece, const HandlesNow& handles,
                                   const DoubtfulData& doubtful, const Eigen::Isometry3d& start,
                                   const std::optional<Eigen::Isometry3d>& expected,
                                   const Services* helpers) {
    std::array<HandleResiduals, 2> kinds;
    auto& [forces, displaced] = kinds;
    displaced.slope = motion_slope(handles.rest);
    displaced.floor = Decision::kNoise;
    Eigen::MatrixXf slope = piece.force_slope();
    doubtful.replace(slope, helpers);
    forces.slope = slope.cast<double>();
    forces.floor = Decision::kForceFloor;
    Eigen::Isometry3d motion = start;
    for (int round = 0; round < 3; ++round) {
        const Eigen::VectorXf data = displacements(handles, motion);
        displaced.values = data.cast<double>();
        if (round == 0) {
            const double size =
                median_size(displaced.values, handles.evidence) / Decision::kDeformed;
            displaced.share = 1 / (1 + std::pow(size, 6));
        }
        Eigen::VectorXf given_way = forces_of(piece, data, helpers);
        doubtful.replace(given_way, helpers);
        forces.values = given_way.cast<double>();
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
    HandlesNow handles(piece, surface, helpers);
    const Eigen::VectorXd told = handles.evidence;
    // The surface stays where it was while nothing is known.
    if (!(told.sum() > 0)) handles.evidence.setOnes();
    Eigen::Isometry3d mean, robust;
    std::optional<DoubtfulData> doubtful;
    helped_loop(helpers, 2, [&](size_t task) {
        if (task == 0) {
            doubtful.emplace(piece, handles.evidence);
        } else {
            mean = fit_rigid(handles.rest, handles.now, handles.evidence);
            robust =
                fit_rigid_robust(handles.rest, handles.now, handles.evidence, Decision::kFloor);
        }
    });
    made.deep = known.held ? *known.held
                : handles.evidence.sum() < Decision::kMinEvidence
                    ? mean
                    : find_deep_motion(piece, handles, *doubtful, robust, known.expected, helpers);
    Eigen::VectorXf data = displacements(handles, made.deep),
                    left = forces_of(piece, data, helpers);
    const Eigen::VectorXf change = doubtful->replace(left, helpers);
    for (size_t k = 0; k < doubtful->rows().size(); ++k)
        data[doubtful->rows()[k]] += change[static_cast<Eigen::Index>(k)];
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
    const Eigen::Matrix<float, 12, 1> support = choices.support();
    helped_runs(helpers, nodes, kNodeRun, [&](size_t begin, size_t end) {
        for (size_t node = begin; node < end; ++node)
            free[node] = move_node(piece, node, measures, choices, support);
    });
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
    for (size_t k = 0; k < BodyPoint::kHandles; ++k)
        place += point.fade * point.weight[k] * piece.left.col(point.handle[k]).cast<double>();
    return {place, now[3], now[4], now[5], now[6], now[7], piece.activity_mm2};
}

}  // namespace defrec
