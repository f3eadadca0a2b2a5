// See unseen_motion.hpp.
#include "sdk/tracking/points/unseen_motion.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <utility>

#include "backends/shared/motion.hpp"
#include "sdk/base/os/helped_loop.hpp"
#include "sdk/tracking/decisions/unseen.hpp"
#include "sdk/tracking/evidence/vertex_runs.hpp"

namespace defrec {
namespace {

using Decision = decisions::UnseenMotion;

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

defrec_motion as_motion_record(const Eigen::Matrix3d& turn, const Eigen::Vector3d& shift) {
    const Eigen::Quaterniond q(turn);
    return from_rigid(Quaternion<double>{q.w(), q.x(), q.y(), q.z()},
                      {shift.x(), shift.y(), shift.z()})
        .store();
}

}  // namespace

UnseenMotion::UnseenMotion(const Template& surface) {
    const TemplateData& data = surface.data();
    for (size_t piece = 0; piece < data.pieces(); ++piece) pieces_.emplace_back(surface, piece);
    if (!pieces_.empty())
        detail_ = {
            data.edges, data.nodes,
            static_cast<float>(decisions::HoleFill::kReach * pieces_.front().view_width_mm())};
    is_parted_.assign(pieces_.size(), 0);
    for (const CutLine& cut : data.node_grid.cuts)
        if (cut.piece < pieces_.size()) is_parted_[cut.piece] = 1;
    misfit_mm2_.assign(pieces_.size(), 0);
    solved_.assign(pieces_.size(), Solved::kNotTried);
    vertex_of_.assign(data.nodes.size() / 3, 0);
    std::vector<float> most(vertex_of_.size(), 0);
    for (size_t i = 0; i < data.vertices.size(); ++i)
        for (size_t k = 0; k < DEFREC_BLEND_NODES; ++k) {
            const auto node = static_cast<size_t>(data.vertices[i].node[k]);
            if (data.vertices[i].weight[k] <= most[node]) continue;
            most[node] = data.vertices[i].weight[k];
            vertex_of_[node] = static_cast<uint32_t>(i);
        }
    cells_moved_.resize(vertex_of_.size());
    weights_.assign(vertex_of_.size(), 0);
    for (size_t i = 0; i < data.vertices.size(); ++i)
        for (size_t k = 0; k < DEFREC_BLEND_NODES; ++k) {
            if (data.vertices[i].weight[k] <= 0) continue;
            const auto node = static_cast<size_t>(data.vertices[i].node[k]);
            cells_moved_[node].set(pieces_[surface.vertex_pieces()[i]].cell_of(i));
            weights_[node] += data.vertices[i].weight[k];
        }
    shapes_.setZero(Decision::kModes, static_cast<Eigen::Index>(vertex_of_.size()));
    for (size_t node = 0; node < vertex_of_.size(); ++node) {
        const Eigen::MatrixXd shapes =
            pieces_[data.piece_of_node(node)].shapes(as_vector(&data.nodes[3 * node]));
        shapes_.col(static_cast<Eigen::Index>(node)).head(shapes.cols()) = shapes.transpose();
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
        for (size_t k = 0; k < DEFREC_BLEND_NODES; ++k) {
            if (data.vertices[i].weight[k] <= 0) continue;
            const std::atomic_ref all(moves_[static_cast<size_t>(data.vertices[i].node[k])]);
            // Most are set already, and to set them again would keep other threads waiting.
            if ((all.load(std::memory_order_relaxed) & moves) != moves)
                all.fetch_or(moves, std::memory_order_relaxed);
        }
    }
}

void UnseenMotion::hide_covered(const TemplateData& data, SurfaceSamples samples,
                                std::span<const uint8_t> covered) {
    if (covered.empty()) return;
    covered_.assign(weights_.size(), 0);
    for (size_t i = 0; i < covered.size(); ++i) {
        // lm takes what is farther in front for no depth of the tissue.
        if (covered[i] == 0 || samples[i].observation == DEFREC_OCCLUDED) continue;
        for (size_t k = 0; k < DEFREC_BLEND_NODES; ++k)
            covered_[static_cast<size_t>(data.vertices[i].node[k])] +=
                std::max(0.0f, data.vertices[i].weight[k]);
    }
    for (size_t node = 0; node < weights_.size(); ++node)
        if (covered_[node] > Decision::kCoveredShare * weights_[node]) moves_[node] = kHidden;
}

bool UnseenMotion::add_frame(const Template& surface, SurfaceSamples samples,
                             std::span<const defrec_piece> pieces, const Results& results,
                             const Services* helpers) {
    const TemplateData& data = surface.data();
    const size_t parts = vertex_parts(helpers, samples.size());
    moves_.assign(results.motions.size(), 0);
    std::atomic<size_t> parts_left = parts;
    // Whether a piece is to be solved for is known once all is read, but is nearly always as in the
    // frame before.
    helped_loop(helpers, parts + 1, [&](size_t part) {
        if (part == 0) return read_pieces(samples, pieces, results.confidence);
        find_moves(data, samples, results.confidence, {part - 1, parts});
        if (--parts_left != 0) return;
        hide_covered(data, samples, results.confidence.covered);
        choose_pieces(data, pieces);
        find_holes(data, results.confidence);
    });
    if (!solve_pieces(data, results.confidence)) return false;
    results.solved();
    if (helpers != nullptr) helpers->rouse(parts - 1);
    helped_loop(helpers, 2, [&](size_t part) {
        if (part == 0) return find_detail(data, results.motions);
        find_variances(data);
        find_misfits(data, results);
    });
    const size_t runs = vertex_runs(samples.size());
    for_phases<2>(helpers, {parts, parts}, [&](size_t phase, size_t index) {
        const ArrayPart part{index, parts};
        if (phase == 0) return move_nodes(data, results, part);
        for (size_t run = part.begin(runs); run < part.end(runs); ++run) {
            move_vertices(surface, results, run);
            results.placed(run);
        }
    });
    return true;
}

void UnseenMotion::add_lost_frame() {
    for (UnseenPiece& piece : pieces_) piece.add_lost_frame();
}

void UnseenMotion::read_pieces(SurfaceSamples samples, std::span<const defrec_piece> pieces,
                               const VertexConfidence& confidence) {
    for (size_t piece = 0; piece < pieces_.size(); ++piece) {
        Solved& solved = solved_[piece];
        const bool was_apart = std::exchange(solved, Solved::kNotTried) == Solved::kYes;
        if (pieces[piece].state == DEFREC_LOST) {
            pieces_[piece].add_lost_frame();
            continue;
        }
        pieces_[piece].read(samples, confidence);
        if (was_apart) solved = pieces_[piece].solve_frame() ? Solved::kYes : Solved::kNo;
    }
}

// Leaves in is_apart_ the pieces of which enough is not seen.
void UnseenMotion::choose_pieces(const TemplateData& data, std::span<const defrec_piece> pieces) {
    hidden_.assign(pieces_.size(), 0);
    is_apart_.assign(pieces_.size(), 0);
    for (size_t node = 0; node < moves_.size(); ++node) {
        const uint8_t piece = data.piece_of_node(node);
        if (is_hidden(node)) ++hidden_[piece];
        if (is_outside(node) || hidden_[piece] >= Decision::kMinHidden) is_apart_[piece] = 1;
    }
    for (size_t piece = 0; piece < pieces_.size(); ++piece)
        if (pieces[piece].state == DEFREC_LOST) is_apart_[piece] = 0;
}

// Leaves in is_apart_ those that tell where what is not seen is; false: none does.
bool UnseenMotion::solve_pieces(const TemplateData& data, const VertexConfidence& confidence) {
    bool any = false, all = true;
    for (size_t piece = 0; piece < pieces_.size(); ++piece) {
        Solved& solved = solved_[piece];
        if (is_apart_[piece] == 0) {
            pieces_[piece].skip_frame();
            solved = Solved::kNotTried;
            continue;
        }
        if (solved == Solved::kNotTried)
            solved = pieces_[piece].solve_frame() ? Solved::kYes : Solved::kNo;
        is_apart_[piece] = solved == Solved::kYes ? 1 : 0;
        any |= solved == Solved::kYes;
        all &= solved == Solved::kYes;
    }
    if (any && !all) find_holes(data, confidence);
    return any;
}

void UnseenMotion::find_variances(const TemplateData& data) {
    cells_asked_.assign(pieces_.size(), {});
    for (size_t node = 0; node < moves_.size(); ++node)
        if (is_outside(node) || is_hidden(node))
            cells_asked_[data.piece_of_node(node)] |= cells_moved_[node];
    for (size_t piece = 0; piece < pieces_.size(); ++piece)
        if (is_apart_[piece] != 0) pieces_[piece].find_variances(cells_asked_[piece]);
}

// Depth does not tell where along the surface a control point is.
bool UnseenMotion::is_known(size_t node, const VertexConfidence& confidence) const {
    return (moves_[node] & kSeen) != 0 &&
           (confidence.evidence[vertex_of_[node]] & DEFREC_EVIDENCE_PHOTOMETRIC) != 0;
}

void UnseenMotion::find_holes(const TemplateData& data, const VertexConfidence& confidence) {
    if (!any_hidden()) return;
    kinds_.assign(moves_.size(), HoleFill::kNeither);
    for (size_t node = 0; node < moves_.size(); ++node)
        if (is_apart_[data.piece_of_node(node)] != 0 && !is_outside(node))
            kinds_[node] = is_hidden(node)              ? HoleFill::kHole
                           : is_known(node, confidence) ? HoleFill::kKnown
                                                        : HoleFill::kUnread;
    detail_.find(kinds_);
}

void UnseenMotion::find_detail(const TemplateData& data, std::span<const defrec_motion> motions) {
    if (!any_hidden()) return;
    for (const uint32_t node : detail_.known())
        detail_.values().col(node) = beyond_modes(data, node, motions).cast<float>();
    detail_.fill();
}

// Modes are smooth across a cut, and its sides are not: the mean at control points that are seen.
void UnseenMotion::find_misfits(const TemplateData& data, const Results& results) {
    for (size_t piece = 0; piece < pieces_.size(); ++piece) {
        if (is_parted_[piece] == 0 || is_apart_[piece] == 0) continue;
        double sum = 0, count = 0;
        for (size_t node = 0; node < moves_.size(); ++node) {
            if (data.piece_of_node(node) != piece || !is_known(node, results.confidence)) continue;
            sum += beyond_modes(data, node, results.motions).squaredNorm();
            ++count;
        }
        if (count > 0) misfit_mm2_[piece] = Decision::kMisfit * sum / count;
    }
}

bool UnseenMotion::any_hidden() const {
    return std::any_of(hidden_.begin(), hidden_.end(), [](uint32_t count) { return count > 0; });
}

bool UnseenMotion::has_lesson() const {
    return std::any_of(pieces_.begin(), pieces_.end(),
                       [](const UnseenPiece& piece) { return piece.has_lesson(); });
}

void UnseenMotion::learn() noexcept {
    for (UnseenPiece& piece : pieces_) try {
            piece.learn();
        } catch (const std::exception&) {
            // Out of memory: later frames teach the same.
        }
}

double UnseenMotion::variance_mm2(uint8_t piece, size_t vertex) const {
    return pieces_[piece].variance_mm2(vertex) + misfit_mm2_[piece];
}

Eigen::Vector3d UnseenMotion::place(const TemplateData& data, size_t node) const {
    return pieces_[data.piece_of_node(node)].place(as_vector(&data.nodes[3 * node]),
                                                   shapes_.col(static_cast<Eigen::Index>(node)));
}

Eigen::Vector3d UnseenMotion::beyond_modes(const TemplateData& data, size_t node,
                                           std::span<const defrec_motion> motions) const {
    return moved(motions[node], as_vector(&data.nodes[3 * node])) - place(data, node);
}

void UnseenMotion::move_nodes(const TemplateData& data, const Results& results,
                              ArrayPart part) const {
    const size_t nodes = results.motions.size();
    for (size_t node = part.begin(nodes); node < part.end(nodes); ++node) {
        const uint8_t piece = data.piece_of_node(node);
        if (is_apart_[piece] == 0) continue;
        if (is_hidden(node) || (is_outside(node) && is_parted_[piece] != 0)) {
            results.motions[node] = move_by_both(data, node, results);
            continue;
        }
        if (!is_outside(node)) continue;
        const Eigen::Vector3d rest = as_vector(&data.nodes[3 * node]);
        const Eigen::Matrix3d turn = pieces_[piece].rotation();
        results.motions[node] = as_motion_record(turn, place(data, node) - turn * rest);
    }
}

// Two estimates, weighed by their covariances: that of lm, and this one.
defrec_motion UnseenMotion::move_by_both(const TemplateData& data, size_t node,
                                         const Results& results) const {
    const uint8_t piece = data.piece_of_node(node);
    const size_t vertex = vertex_of_[node];
    Eigen::Vector3d there = place(data, node);
    if (is_hidden(node))
        there += detail_.values().col(static_cast<Eigen::Index>(node)).cast<double>();
    const Eigen::Vector3d step =
        there - moved(results.motions[node], as_vector(&data.nodes[3 * node]));
    const Eigen::Matrix3d of_lm = as_matrix(&results.confidence.covariance[6 * vertex]);
    Eigen::Matrix3d sum = of_lm;
    sum.diagonal().array() += variance_mm2(piece, vertex) / 3;
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

// Where a cut parts the piece, that of two independent estimates; what both share stays.
UnseenMotion::Remaining UnseenMotion::remaining(uint8_t piece, size_t vertex, const Shares& share,
                                                double squared_step,
                                                const VertexConfidence& confidence) const {
    const double unseen = share.outside + share.hidden,
                 common = static_cast<double>(confidence.common_at(vertex)),
                 of_modes = variance_mm2(piece, vertex),
                 of_step = Decision::kStepShare * share.hidden * squared_step;
    if (is_parted_[piece] == 0)
        return {1 - share.outside - (1 - Decision::kLmShare) * share.hidden,
                unseen * (of_modes + common) + of_step};
    const double all = std::pow(static_cast<double>(confidence.expected_error[vertex]), 2),
                 of_lm = all - common;
    if (of_lm <= 0) return {1, of_step};
    return {1 - unseen * of_lm / (of_lm + of_modes) * of_lm / all, of_step};
}

void UnseenMotion::move_vertices(const Template& surface, const Results& results,
                                 size_t run) const {
    const TemplateData& data = surface.data();
    const size_t end = std::min(data.vertices.size(), (run + 1) * kVertexRun);
    for (size_t i = run * kVertexRun; i < end; ++i) {
        const defrec_surface_point& vertex = data.vertices[i];
        if (is_apart_[surface.vertex_pieces()[i]] == 0) continue;
        const Shares share = shares_of(vertex);
        if (share.outside + share.hidden <= 0) continue;
        const Eigen::Vector3d before = as_vector(&results.vertices[3 * i]);
        const auto motion = blend<double>(results.motions.data(), vertex.node, vertex.weight);
        store3(apply(motion, load3<double>(vertex.position)), &results.vertices[3 * i]);
        store3(rotate(motion, load3<double>(vertex.normal)), &results.normals[3 * i]);
        // Tissue that departed stays unknown.
        if (results.confidence.status[i] == DEFREC_POINT_UNKNOWN && share.outside <= 0) continue;
        const auto [kept, own] = remaining(
            surface.vertex_pieces()[i], i, share,
            (as_vector(&results.vertices[3 * i]) - before).squaredNorm(), results.confidence);
        float* covariance = &results.confidence.covariance[6 * i];
        for (size_t k = 0; k < 6; ++k)
            covariance[k] = static_cast<float>(kept * static_cast<double>(covariance[k]) +
                                               (k == 0 || k == 3 || k == 5 ? own / 3 : 0.0));
        results.confidence.expected_error[i] =
            std::sqrt(covariance[0] + covariance[3] + covariance[5]);
    }
}

}  // namespace defrec
