// See unseen_motion.hpp.
#include "sdk/tracking/points/unseen_motion.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <utility>

#include "backends/shared/motion.hpp"
#include "sdk/body/deep_motion.hpp"
#include "sdk/tracking/evidence/vertex_runs.hpp"
#include "sdk/tracking/frame/decisions.hpp"

namespace defrec {
namespace {

using Decision = decisions::UnseenMotion;

constexpr double kJitter = 1e-6;

Eigen::Vector3d as_vector(const float* xyz) {
    return Eigen::Map<const Eigen::Vector3f>(xyz).cast<double>();
}

// xx, xy, xz, yy, yz, zz.
Eigen::Matrix3d as_matrix(const float* covariance) {
    const Eigen::Map<const Eigen::Matrix<float, 6, 1>> c(covariance);
    Eigen::Matrix3f all;
    all << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
    return all.cast<double>();
}

Eigen::Vector3d moved(const defrec_motion& motion, const Eigen::Vector3d& place) {
    const Vec3<double> now =
        apply(DualQuaternion<double>::load(motion), {place.x(), place.y(), place.z()});
    return {now.x, now.y, now.z};
}

// Errors of neighbouring vertices are alike: a mean of many is no better than each.
double noise_mm2(double error_mm2) {
    return Decision::kNoise * Decision::kNoise + Decision::kErrorShare * error_mm2;
}

defrec_motion as_motion_record(const Eigen::Matrix3d& turn, const Eigen::Vector3d& shift) {
    const Eigen::Quaterniond q(turn);
    return from_rigid(Quaternion<double>{q.w(), q.x(), q.y(), q.z()},
                      {shift.x(), shift.y(), shift.z()})
        .store();
}

}  // namespace

UnseenPiece::UnseenPiece(const Template& surface, size_t piece)
    : cells_(surface, piece), length_mm_(Decision::kLengthShare * cells_.view_width_mm()) {
    const Eigen::Index count = cells_.rest().cols(), modes = std::min(count, Decision::kModes);
    variance_.assign(cells_.size(), 0);
    if (count == 0) return;
    Eigen::MatrixXd alike = kernel(cells_.rest(), cells_.rest());
    alike.diagonal().array() += kJitter;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> parts(alike);
    at_cells_ = parts.eigenvectors().rightCols(modes);
    spread_ = parts.eigenvalues().tail(modes);
    weigher_ = at_cells_ * spread_.cwiseInverse().asDiagonal();
    products_.setZero(3 * modes, 3 * modes);
}

void UnseenPiece::learn_from(const UnseenPiece& before) {
    if (before.cells_.size() == 0 || cells_.size() == 0) return;
    const Eigen::MatrixXd shapes = before.shapes(cells_.rest()),
                          change = at_cells_.transpose() * shapes,
                          unknown = spread_.asDiagonal().toDenseMatrix() -
                                    change * before.spread_.asDiagonal() * change.transpose();
    Eigen::MatrixXd on_axes = Eigen::MatrixXd::Zero(products_.rows(), before.products_.rows());
    add_on_axes(change, on_axes);
    products_ = on_axes * before.products_ * on_axes.transpose();
    add_on_axes(before.frames_ * Decision::kStart * Decision::kStart * unknown, products_);
    frames_ = before.frames_;
    cells_.take_ages(before.cells_);
    all_frames_ = before.all_frames_;
}

// Matern's covariance of order 3/2.
Eigen::MatrixXd UnseenPiece::kernel(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) const {
    const double scale = std::sqrt(3.0) / length_mm_;
    Eigen::MatrixXd values(a.cols(), b.cols());
    Eigen::ArrayXd distance(a.cols());
    for (Eigen::Index j = 0; j < b.cols(); ++j) {
        distance = scale * (a.colwise() - b.col(j)).colwise().norm().transpose();
        values.col(j) = (1 + distance) * (-distance).exp();
    }
    return values;
}

Eigen::MatrixXd UnseenPiece::shapes(const Eigen::Matrix3Xd& places) const {
    return kernel(cells_.rest(), places).transpose() * weigher_;
}

bool UnseenPiece::add_frame(const Seen& seen) {
    lesson_ = Lesson::kNone;
    if (!cells_.read(seen.samples, seen.confidence)) return false;
    ++all_frames_;
    if (seen.is_apart) {
        if (!solve() || !find_variances()) return false;
        lesson_ = Lesson::kSolved;
        return true;
    }
    if (cells_.seen().rest.cols() == cells_.rest().cols())
        lesson_ = Lesson::kDirect;
    else if (all_frames_ % Decision::kLearnEvery == 0)
        lesson_ = Lesson::kSolve;
    return false;
}

// covariance: of the coefficients' errors.
void UnseenPiece::learn(const Eigen::MatrixX3d& coefficients, const Eigen::MatrixXd& covariance) {
    products_ *= Decision::kForget;
    products_.noalias() += coefficients.reshaped() * coefficients.reshaped().transpose();
    products_ += covariance;
    frames_ = Decision::kForget * frames_ + 1;
    information_.resize(0, 0);
}

// Kriging gives what is seen where every cell is.
void UnseenPiece::learn_directly() {
    const UnseenCells::Seen& seen = cells_.seen();
    const Eigen::Isometry3d pose =
        fit_rigid(seen.rest, seen.now, Eigen::VectorXd::Ones(seen.rest.cols()));
    const Eigen::Matrix3Xd displacements = pose.inverse() * seen.now - seen.rest;
    const Eigen::VectorXd noise = seen.error_mm2.unaryExpr(&noise_mm2);
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(products_.rows(), products_.cols());
    add_on_axes(at_cells_.transpose() * noise.asDiagonal() * at_cells_, covariance);
    learn(at_cells_.transpose() * displacements.transpose(), covariance);
}

const Eigen::MatrixXd& UnseenPiece::information() {
    if (information_.size() > 0) return information_;
    Eigen::MatrixXd sum = products_;
    add_on_axes(Decision::kStartFrames * Decision::kStart * Decision::kStart *
                    spread_.asDiagonal().toDenseMatrix(),
                sum);
    information_ = (Decision::kStartFrames + frames_) * inverse_of(sum);
    return information_;
}

// Finds the pose and the coefficients; false: the numbers do not do.
bool UnseenPiece::solve() {
    const UnseenCells::Seen& seen = cells_.seen();
    const Eigen::Vector3d centre = seen.rest.rowwise().mean();
    const Eigen::MatrixXd shapes_seen = shapes(seen.rest);
    // Means of parts of cells lie off the cells' means, and modes do not tell everything.
    Eigen::VectorXd noise = Decision::kStart * Decision::kStart *
                            (1 - (shapes_seen.cwiseAbs2() * spread_).array()).max(0.0).matrix();
    noise += seen.error_mm2.unaryExpr(&noise_mm2);

    pose_ = fit_rigid(seen.rest, seen.now, Eigen::VectorXd::Ones(noise.size()));
    const auto displacements = [&]() -> Eigen::Matrix3Xd {
        return pose_.inverse() * seen.now - seen.rest;
    };
    Eigen::Matrix3Xd values = displacements();
    kriging_.emplace(DisplacementModel(shapes_seen, seen.rest.colwise() - centre), information());
    kriging_->weigh(noise);
    // A cell that stands out hides another one from the first round.
    for (int round = 0; round < Decision::kRaises; ++round) {
        const double largest = kriging_->raise_noise(values, noise);
        kriging_->weigh(noise);
        if (largest < Decision::kStandsOut) break;
    }
    for (int round = 0; round < 2; ++round) {
        pose_ = pose_ * Eigen::Translation3d(centre) * as_motion(kriging_->solve(values).motion) *
                Eigen::Translation3d(-centre);
        values = displacements();
    }
    coefficients_ = kriging_->solve(values).coefficients;
    smooth_ = (weigher_ * coefficients_).transpose();
    if (smooth_.allFinite()) return true;
    kriging_.reset();
    return false;
}

// false: the numbers do not do.
bool UnseenPiece::find_variances() {
    const Eigen::Vector3d centre = cells_.seen().rest.rowwise().mean();
    const Eigen::VectorXd variances =
        kriging_->variances({at_cells_, cells_.rest().colwise() - centre});
    for (Eigen::Index i = 0; i < variances.size(); ++i)
        variance_[static_cast<size_t>(i)] = Decision::kVarianceShare * variances[i] + unseen_mm2(i);
    return variances.allFinite();
}

void UnseenPiece::learn() {
    switch (std::exchange(lesson_, Lesson::kNone)) {
        case Lesson::kNone:
            return;
        case Lesson::kDirect:
            return learn_directly();
        case Lesson::kSolve:
            if (solve()) learn(coefficients_, kriging_->covariance());
            return;
        case Lesson::kSolved:
            learn(coefficients_, kriging_->covariance());
            information();  // the next frame is likely to ask for it
    }
}

// Variance of motion that a cell has for itself: since it was seen, and far from what is seen.
double UnseenPiece::unseen_mm2(Eigen::Index cell) const {
    const Eigen::Matrix3Xd& seen = cells_.seen().rest;
    const double nearest = std::sqrt(
                     (seen.colwise() - cells_.rest().col(cell)).colwise().squaredNorm().minCoeff()),
                 far = std::clamp((nearest - cells_.apart_mm() / 2) / Decision::kFar, 0.0, 1.0),
                 unseen = std::min(cells_.age(cell), Decision::kLong);
    return Decision::kMost * Decision::kMost * far * far * unseen / Decision::kLong;
}

Eigen::Vector3d UnseenPiece::place(const Eigen::Vector3d& at_rest) const {
    return pose_ * (at_rest + smooth_ * kernel(cells_.rest(), at_rest));
}

UnseenMotion::UnseenMotion(const Template& surface) {
    const TemplateData& data = surface.data();
    for (size_t piece = 0; piece < data.pieces(); ++piece) pieces_.emplace_back(surface, piece);
    vertex_of_.assign(data.nodes.size() / 3, 0);
    std::vector<float> most(vertex_of_.size(), 0);
    for (size_t i = 0; i < data.vertices.size(); ++i)
        for (size_t k = 0; k < DEFREC_BLEND_NODES; ++k) {
            const auto node = static_cast<size_t>(data.vertices[i].node[k]);
            if (data.vertices[i].weight[k] <= most[node]) continue;
            most[node] = data.vertices[i].weight[k];
            vertex_of_[node] = static_cast<uint32_t>(i);
        }
}

UnseenMotion::UnseenMotion(const Template& surface, const UnseenMotion& before)
    : UnseenMotion(surface) {
    for (size_t piece = 0; piece < std::min(pieces_.size(), before.pieces_.size()); ++piece)
        pieces_[piece].learn_from(before.pieces_[piece]);
}

// Finds what each control point moves, from a part of the vertices. Threads set the same flags.
void UnseenMotion::find_moves(const TemplateData& data, SurfaceSamples samples,
                              const VertexConfidence& confidence, ArrayPart part) {
    for (size_t i = part.begin(samples.size()); i < part.end(samples.size()); ++i) {
        // Tissue that departed, or is far from all that is seen, stays where lm has it.
        const bool is_seen =
            confidence.evidence[i] != 0 || confidence.status[i] == DEFREC_POINT_UNKNOWN;
        const uint8_t moves = samples[i].observation == DEFREC_OUTSIDE ? kOutside
                              : is_seen                                ? kSeen
                                                                       : kHidden;
        for (size_t k = 0; k < DEFREC_BLEND_NODES; ++k)
            if (data.vertices[i].weight[k] > 0)
                std::atomic_ref(moves_[static_cast<size_t>(data.vertices[i].node[k])])
                    .fetch_or(moves, std::memory_order_relaxed);
    }
}

bool UnseenMotion::add_frame(const Template& surface, SurfaceSamples samples,
                             std::span<const defrec_piece> pieces, const Results& results,
                             const Services* helpers) {
    const TemplateData& data = surface.data();
    const size_t parts = vertex_parts(helpers, samples.size());
    moves_.assign(results.motions.size(), 0);
    for_each_task(helpers, parts, [&](size_t part) {
        find_moves(data, samples, results.confidence, {part, parts});
    });
    hidden_.assign(pieces_.size(), 0);
    is_apart_.assign(pieces_.size(), 0);
    for (size_t node = 0; node < moves_.size(); ++node) {
        const uint8_t piece = data.piece_of_node(node);
        if (is_hidden(node)) ++hidden_[piece];
        if (is_outside(node) || hidden_[piece] >= Decision::kMinHidden) is_apart_[piece] = 1;
    }
    if (!ask_pieces(samples, pieces, results.confidence)) return false;
    if (std::any_of(hidden_.begin(), hidden_.end(), [](uint32_t count) { return count > 0; }))
        find_detail(data, results.motions, results.confidence);
    for_phases<2>(helpers, {parts, parts}, [&](size_t phase, size_t part) {
        if (phase == 0)
            move_nodes(data, results, {part, parts});
        else
            move_vertices(surface, results, {part, parts});
    });
    return true;
}

// Leaves in is_apart_ the pieces that tell where what is not seen is; false: none does.
bool UnseenMotion::ask_pieces(SurfaceSamples samples, std::span<const defrec_piece> pieces,
                              const VertexConfidence& confidence) {
    bool any = false;
    for (size_t piece = 0; piece < pieces_.size(); ++piece) {
        const bool is_lost = pieces[piece].state == DEFREC_LOST;
        if (is_lost) pieces_[piece].add_lost_frame();
        const bool is_told =
            !is_lost && pieces_[piece].add_frame({samples, confidence, is_apart_[piece] != 0});
        is_apart_[piece] = is_told ? 1 : 0;
        any |= is_told;
    }
    return any;
}

// Depth does not tell where along the surface a control point is.
void UnseenMotion::find_detail(const TemplateData& data, std::span<const defrec_motion> motions,
                               const VertexConfidence& confidence) {
    kinds_.assign(moves_.size(), HoleFill::kNeither);
    for (size_t node = 0; node < moves_.size(); ++node)
        if (is_apart_[data.piece_of_node(node)] != 0 && !is_outside(node))
            kinds_[node] =
                (confidence.evidence[vertex_of_[node]] & DEFREC_EVIDENCE_PHOTOMETRIC) != 0
                    ? HoleFill::kKnown
                    : HoleFill::kHole;
    detail_.find(data.edges, kinds_);
    for (const uint32_t node : detail_.border()) {
        const Eigen::Vector3d rest = as_vector(&data.nodes[size_t{3} * node]);
        detail_.values().col(node) =
            moved(motions[node], rest) - pieces_[data.piece_of_node(node)].place(rest);
    }
    detail_.fill();
}

void UnseenMotion::learn() noexcept {
    for (UnseenPiece& piece : pieces_) try {
            piece.learn();
        } catch (const std::exception&) {
            // Out of memory: later frames teach the same.
        }
}

void UnseenMotion::move_nodes(const TemplateData& data, const Results& results,
                              ArrayPart part) const {
    const size_t nodes = results.motions.size();
    for (size_t node = part.begin(nodes); node < part.end(nodes); ++node) {
        const uint8_t piece = data.piece_of_node(node);
        if (is_apart_[piece] == 0) continue;
        if (is_hidden(node)) results.motions[node] = move_hidden(data, node, results);
        if (!is_outside(node)) continue;
        const Eigen::Vector3d rest = as_vector(&data.nodes[3 * node]);
        const Eigen::Matrix3d turn = pieces_[piece].rotation();
        results.motions[node] = as_motion_record(turn, pieces_[piece].place(rest) - turn * rest);
    }
}

// Two estimates, weighed by their covariances: that of lm, and this one.
defrec_motion UnseenMotion::move_hidden(const TemplateData& data, size_t node,
                                        const Results& results) const {
    const UnseenPiece& piece = pieces_[data.piece_of_node(node)];
    const size_t vertex = vertex_of_[node];
    const Eigen::Vector3d rest = as_vector(&data.nodes[3 * node]),
                          step = piece.place(rest) +
                                 detail_.values().col(static_cast<Eigen::Index>(node)) -
                                 moved(results.motions[node], rest);
    const Eigen::Matrix3d of_lm = as_matrix(&results.confidence.covariance[6 * vertex]);
    Eigen::Matrix3d sum = of_lm;
    sum.diagonal().array() += piece.variance_mm2(vertex) / 3;
    const Eigen::Vector3d shift = of_lm * sum.ldlt().solve(step);
    if (!shift.allFinite()) return results.motions[node];
    const auto motion = DualQuaternion<double>::load(results.motions[node]);
    return from_rigid(motion.real,
                      translation(motion) + Vec3<double>{shift.x(), shift.y(), shift.z()})
        .store();
}

UnseenMotion::Shares UnseenMotion::shares_of(const defrec_surface_point& vertex) const {
    Shares shares;
    for (size_t k = 0; k < DEFREC_BLEND_NODES; ++k) {
        const auto node = static_cast<size_t>(vertex.node[k]);
        if (is_outside(node)) shares.outside += static_cast<double>(vertex.weight[k]);
        if (is_hidden(node)) shares.hidden += static_cast<double>(vertex.weight[k]);
    }
    return shares;
}

void UnseenMotion::move_vertices(const Template& surface, const Results& results,
                                 ArrayPart part) const {
    const TemplateData& data = surface.data();
    for (size_t i = part.begin(data.vertices.size()); i < part.end(data.vertices.size()); ++i) {
        const defrec_surface_point& vertex = data.vertices[i];
        const UnseenPiece& piece = pieces_[surface.vertex_pieces()[i]];
        if (is_apart_[surface.vertex_pieces()[i]] == 0) continue;
        const Shares share = shares_of(vertex);
        if (share.outside + share.hidden <= 0) continue;
        const Eigen::Vector3d before = as_vector(&results.vertices[3 * i]);
        const auto motion = blend<double>(results.motions.data(), vertex.node, vertex.weight);
        store3(apply(motion, load3<double>(vertex.position)), &results.vertices[3 * i]);
        store3(rotate(motion, load3<double>(vertex.normal)), &results.normals[3 * i]);
        // Tissue that departed stays unknown.
        if (results.confidence.status[i] == DEFREC_POINT_UNKNOWN && share.outside <= 0) continue;
        const double squared_step = (as_vector(&results.vertices[3 * i]) - before).squaredNorm(),
                     kept = 1 - share.outside - (1 - Decision::kLmShare) * share.hidden,
                     own = (share.outside + share.hidden) * piece.variance_mm2(i) +
                           Decision::kStepShare * share.hidden * squared_step;
        float* covariance = &results.confidence.covariance[6 * i];
        for (size_t k = 0; k < 6; ++k)
            covariance[k] = static_cast<float>(kept * static_cast<double>(covariance[k]) +
                                               (k == 0 || k == 3 || k == 5 ? own / 3 : 0.0));
        results.confidence.expected_error[i] =
            std::sqrt(covariance[0] + covariance[3] + covariance[5]);
    }
}

}  // namespace defrec
