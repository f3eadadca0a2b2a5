// The terms of the cost and their sums into the normal equations.
#include "backends/reference/lm_problem.hpp"

namespace defrec::reference {

LmProblem::LmProblem(const defrec_lm_params& params, const LmTemplate& surface, const Host& host)
    : params_(params),
      surface_(surface),
      present_(surface.pattern, host),
      trial_(surface.pattern, host),
      motions_(surface.nodes.size(), HostAllocator<DualQuaternion<double>>(host)),
      poses_(surface.nodes.size(), HostAllocator<NodePose<double>>(host)),
      data_(surface.nodes.size(), HostAllocator<double>(host)),
      arap_scale_(surface.edges.size(), HostAllocator<double>(host)),
      diagonal_(surface.nodes.size() * 6, HostAllocator<double>(host)),
      residual_(diagonal_.size(), HostAllocator<double>(host)),
      direction_(diagonal_.size(), HostAllocator<double>(host)),
      product_(diagonal_.size(), HostAllocator<double>(host)),
      conditioned_(diagonal_.size(), HostAllocator<double>(host)),
      right_(diagonal_.size(), HostAllocator<double>(host)) {}

void LmProblem::blend_motions(std::span<const NodePose<double>> nodes) {
    for (size_t i = 0; i < nodes.size(); ++i) {
        poses_[i] = nodes[i];
        motions_[i] = from_rigid(nodes[i].rotation,
                                 nodes[i].position - rotate(nodes[i].rotation, surface_.nodes[i]));
    }
}

LmSums LmProblem::begin(std::span<const NodePose<double>> nodes) {
    std::fill(arap_scale_.begin(), arap_scale_.end(), 0.0);
    evaluate(nodes, true);
    measure_data();
    const LmSums sums = evaluate(nodes, true);
    accept();
    return sums;
}

LmSums LmProblem::evaluate(std::span<const NodePose<double>> nodes, bool linearise) {
    linearise_ = linearise;
    if (linearise) {
        std::fill(trial_.blocks.begin(), trial_.blocks.end(), 0.0);
        std::fill(trial_.gradient.begin(), trial_.gradient.end(), 0.0);
        std::fill(data_.begin(), data_.end(), 0.0);
    }
    blend_motions(nodes);
    LmSums sums;
    add_points(sums);
    add_matches(sums);
    add_patches(sums);
    sums.arap = add_edges(nodes);
    return sums;
}

// The weight of the ARAP term follows that of the data (paper, below its equation 1).
void LmProblem::measure_data() {
    double sum = 0, squares = 0;
    for (const double weight : data_) {
        sum += weight;
        squares += weight * weight;
    }
    const double usual = sum > 0 ? squares / sum : 0;
    for (size_t i = 0; i < surface_.edges.size(); ++i) {
        const defrec_edge& edge = surface_.edges[i];
        const double data = (data_[size_t(edge.a)] + data_[size_t(edge.b)]) / 2;
        arap_scale_[i] = kArapShare * double(params_.arap_weight) * double(edge.weight) /
                         surface_.mean_degree * (data + usual) / 2;
    }
}

template <class Item>
void LmProblem::add_rows(const Item& item, std::span<const Row<double>> rows, double weight) {
    Vec3<double> arm[DEFREC_BLEND_NODES];
    for (int k = 0; k < DEFREC_BLEND_NODES; ++k) {
        const size_t node = size_t(item.node[k]);
        arm[k] = rotate(poses_[node].rotation, load3<double>(item.position) - surface_.nodes[node]);
        data_[node] += double(item.weight[k]) * weight;
    }
    for (const Row<double>& row : rows) {
        double jacobian[DEFREC_BLEND_NODES][6];
        for (int k = 0; k < DEFREC_BLEND_NODES; ++k) {
            const Vec3<double> shift = double(item.weight[k]) * row.gradient,
                               turn = cross(arm[k], shift);
            const double j[6] = {turn.x, turn.y, turn.z, shift.x, shift.y, shift.z};
            std::copy(j, j + 6, jacobian[k]);
        }
        for (int k = 0; k < DEFREC_BLEND_NODES; ++k) {
            for (int r = 0; r < 6; ++r)
                trial_.gradient[size_t(item.node[k]) * 6 + size_t(r)] +=
                    weight * row.value * jacobian[k][r];
            for (int l = 0; l < DEFREC_BLEND_NODES; ++l) {
                double* block =
                    &trial_.blocks[surface_.pattern.find(item.node[k], item.node[l]) * 36];
                for (int r = 0; r < 6; ++r)
                    for (int c = 0; c < 6; ++c)
                        block[r * 6 + c] += weight * jacobian[k][r] * jacobian[l][c];
            }
        }
    }
}

namespace {
// A residual of squared size `squared` enters the sums; returns its weight in the system.
double count_residual(LmSums::Term& term, const Robust<double>& robust, double weight,
                      double squared) {
    term.cost += weight * robust.cost;
    if (!(robust.weight * weight > 0)) return 0;
    ++term.count;
    term.weights += robust.weight;
    term.squares += robust.weight * squared;
    return weight * robust.weight;
}
}  // namespace

void LmProblem::add_points(LmSums& sums) {
    const double inverse_c2 = 1 / (double(params_.icp_tukey_mm) * double(params_.icp_tukey_mm)),
                 weight = double(params_.icp_weight);
    for (const defrec_surface_point& point : surface_.points) {
        const auto motion = blend<double>(motions_.data(), point.node, point.weight);
        const Vec3<double> position = apply(motion, load3<double>(point.position)),
                           normal = rotate(motion, load3<double>(point.normal));
        Row<double> row;
        if (!icp_row(params_.camera, frame_.disparity, double(params_.association_mm), position,
                     normal, row)) {
            sums.missing += weight / (3 * inverse_c2);
            continue;
        }
        const double squared = row.value * row.value;
        const double total = count_residual(sums.icp, tukey(squared, inverse_c2), weight, squared);
        if (linearise_ && total > 0) add_rows(point, std::span(&row, 1), total);
    }
}

void LmProblem::add_matches(LmSums& sums) {
    if (frame_.matches == nullptr) return;
    const double inverse_c2 = 1 / (double(params_.match_tukey_mm) * double(params_.match_tukey_mm));
    for (size_t i = 0; i < surface_.landmarks.size(); ++i) {
        const defrec_match& match = frame_.matches[i];
        if (!has_depth(match)) continue;
        const bool preselected = match.weight > 0;
        const double inverse_a = preselected ? 0 : 1 / (5 * double(params_.match_threshold_mm));
        const double weight =
            double(params_.match_weight) * (preselected ? double(match.weight) : 1);
        add_sighting(surface_.landmarks[i], match_sighting(load3<double>(match.position)), weight,
                     inverse_a, inverse_c2, 1, sums.match);
    }
}

void LmProblem::add_patches(LmSums& sums) {
    if (frame_.observations == nullptr) return;
    for (size_t i = 0; i < surface_.patches.size(); ++i) {
        const defrec_patch& patch = surface_.patches[i];
        Sighting<double> sighting;
        if (!patch_sighting(params_.camera, frame_.observations[i], sighting)) continue;
        const auto motion = blend<double>(motions_.data(), patch.node, patch.weight);
        const double px = px_per_mm(params_.camera, apply(motion, load3<double>(patch.position)).z);
        const double tukey_mm = double(params_.patch_tukey_px) / px;
        add_sighting(patch, sighting, double(params_.patch_weight), 0, 1 / (tukey_mm * tukey_mm),
                     px, sums.patch);
    }
}

// unit: of the residual in the summary, per mm.
template <class Item>
void LmProblem::add_sighting(const Item& item, const Sighting<double>& sighting, double weight,
                             double inverse_a, double inverse_c2, double unit, LmSums::Term& term) {
    const auto motion = blend<double>(motions_.data(), item.node, item.weight);
    Row<double> rows[3];
    sighting_rows(apply(motion, load3<double>(item.position)), sighting, rows);
    const double squared = rows[0].value * rows[0].value + rows[1].value * rows[1].value +
                           rows[2].value * rows[2].value;
    const double total = count_residual(term, ramped_tukey(squared, inverse_a, inverse_c2), weight,
                                        squared * unit * unit);
    if (linearise_ && total > 0) add_rows(item, rows, total);
}

double LmProblem::add_edges(std::span<const NodePose<double>> nodes) {
    const double spacing2 = double(params_.node_spacing_mm) * double(params_.node_spacing_mm);
    double cost = 0;
    for (size_t i = 0; i < surface_.edges.size(); ++i) {
        const defrec_edge& edge = surface_.edges[i];
        const NodePose<double>&a = nodes[size_t(edge.a)], &b = nodes[size_t(edge.b)];
        const auto geometry =
            arap_geometry(a, b, surface_.rest_direction[i], surface_.rest_length[i]);
        const ArapWeights<double> weights{
            arap_scale_[i] * double(params_.length_weight),
            arap_scale_[i] * double(params_.angle_weight) * spacing2,
            arap_scale_[i] * double(params_.rotation_weight) * spacing2};
        if (!linearise_) {
            cost += arap_cost(geometry, a.rotation, weights);
            continue;
        }
        const ArapTerm<double> term = arap_term(geometry, a.rotation, weights);
        cost += term.cost;
        add_term(edge, term);
    }
    return cost;
}

void LmProblem::add_term(const defrec_edge& edge, const ArapTerm<double>& term) {
    const BlockPattern& pattern = surface_.pattern;
    double* aa = &trial_.blocks[pattern.find(edge.a, edge.a) * 36];
    double* bb = &trial_.blocks[pattern.find(edge.b, edge.b) * 36];
    double* ab = &trial_.blocks[pattern.find(edge.a, edge.b) * 36];
    double* ba = &trial_.blocks[pattern.find(edge.b, edge.a) * 36];
    for (int r = 0; r < 6; ++r) {
        trial_.gradient[size_t(edge.a) * 6 + size_t(r)] += term.gradient_a[r];
        trial_.gradient[size_t(edge.b) * 6 + size_t(r)] += term.gradient_b[r];
        for (int c = 0; c < 6; ++c) {
            aa[r * 6 + c] += term.aa[r * 6 + c];
            bb[r * 6 + c] += term.bb[r * 6 + c];
            ab[r * 6 + c] += term.ab[r * 6 + c];
            ba[c * 6 + r] += term.ab[r * 6 + c];
        }
    }
}

}  // namespace defrec::reference
