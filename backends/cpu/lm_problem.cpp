// Assembly of the system from the groups and the edges.
#include "backends/cpu/lm_problem.hpp"

namespace defrec::cpu {

LmProblem::LmProblem(const defrec_lm_params& params, const LmTemplate& surface, const Host& host)
    : params_(params),
      surface_(surface),
      host_(host),
      pattern_(surface.pattern, host),
      groups_(surface, host),
      edges_(surface, pattern_, host),
      places_(HostAllocator<std::array<uint32_t, LmGroupSums::kPairs>>(host)),
      unconnected_(HostAllocator<uint32_t>(host)),
      sums_(groups_.groups().size(), HostAllocator<LmGroupSums>(host)),
      scratch_(kTasks * lm_scratch_floats(groups_), HostAllocator<float>(host)),
      motions_(surface.nodes.size(), HostAllocator<NodeMotion>(host)),
      poses_(surface.nodes.size() * 8, HostAllocator<float>(host)),
      edge_nodes_(surface.nodes.size() * kNodeFloats, HostAllocator<float>(host)),
      data_(surface.nodes.size(), HostAllocator<double>(host)),
      present_(pattern_, host),
      trial_(pattern_, host),
      workspace_(pattern_, host) {
    std::vector<bool> connected(pattern_.blocks(), false);
    for (size_t i = 0; i < edges_.count; ++i) connected[edges_.block[i]] = true;
    for (size_t b = 0; b < connected.size(); ++b)
        if (!connected[b]) unconnected_.push_back(uint32_t(b));
    for (const LmGroup& group : groups_.groups()) {
        auto& places = places_.emplace_back();
        size_t pair = 0;
        for (size_t k = 0; k < kSkin; ++k)
            for (size_t l = 0; l <= k; ++l, ++pair)
                places[pair] = uint32_t(k == l || group.node[k] == group.node[l]
                                            ? size_t(group.node[k])
                                            : pattern_.find(group.node[k], group.node[l]));
    }
}

void LmProblem::set_frame(const LmFrame& frame) {
    image_ = frame.disparity;
    groups_.set_frame(params_, frame);
}

LmSums LmProblem::begin(std::span<const NodePose<double>> nodes) {
    set_nodes(nodes);
    host_.parallel_for(kTasks, [this](size_t i) { sum_surface(i, true); });
    measure_data();
    sum_arap(true);
    assemble();
    accept();
    return total();
}

LmSums LmProblem::evaluate(std::span<const NodePose<double>> nodes, bool linearise) {
    set_nodes(nodes);
    host_.parallel_for(kTasks + 1, [&](size_t i) {
        if (i == 0)
            sum_arap(linearise);
        else
            sum_surface(i - 1, linearise);
    });
    if (linearise) assemble();
    return total();
}

bool LmProblem::solve(double lambda, double* step) {
    const uint32_t iterations = gradient_steps(params_);
    if (!solve_system({&pattern_, &present_, &workspace_, float(lambda), iterations})) return false;
    std::copy_n(workspace_.x.begin(), 6 * pattern_.rows(), step);
    return true;
}

void LmProblem::set_nodes(std::span<const NodePose<double>> nodes) {
    for (size_t i = 0; i < nodes.size(); ++i) {
        const auto& [q, p] = nodes[i];
        motions_[i].set(from_rigid(q, p - rotate(q, surface_.nodes[i])), surface_.nodes[i]);
        const double pose[8] = {q.w, q.x, q.y, q.z, p.x, p.y, p.z, 0};
        std::copy(pose, pose + 8, &poses_[8 * i]);
    }
}

void LmProblem::sum_surface(size_t task, bool linearise) {
    const size_t count = sums_.size(), room = scratch_.size() / kTasks;
    const LmGroupTask work{&groups_,    motions_.data(), &params_,
                           image_,      linearise,       scratch_.data() + task * room,
                           sums_.data()};
    sum_groups(work, count * task / kTasks, count * (task + 1) / kTasks);
}

void LmProblem::sum_arap(bool linearise) {
    const LmConstants constants = constants_of(params_);
    if (linearise) std::fill(edge_nodes_.begin(), edge_nodes_.end(), 0.0f);
    arap_cost_ =
        sum_edges({&edges_, poses_.data(), constants.length_weight, constants.angle_weight,
                   constants.rotation_weight, linearise, trial_.lower.data(), edge_nodes_.data()});
}

// The weight of the ARAP term follows that of the data (paper, below its equation 1).
void LmProblem::measure_data() {
    std::fill(data_.begin(), data_.end(), 0.0);
    for (size_t g = 0; g < sums_.size(); ++g)
        for (size_t k = 0; k < kSkin; ++k)
            data_[size_t(groups_.groups()[g].node[k])] += double(sums_[g].data[k]);
    double sum = 0, squares = 0;
    for (const double weight : data_) {
        sum += weight;
        squares += weight * weight;
    }
    const double usual = sum > 0 ? squares / sum : 0;
    for (size_t i = 0; i < edges_.count; ++i) {
        const double data = (data_[size_t(edges_.a[i])] + data_[size_t(edges_.b[i])]) / 2;
        edges_.weight[i] =
            float(kArapShare * double(params_.arap_weight) * double(surface_.edges[i].weight) /
                  surface_.mean_degree * (data + usual) / 2);
    }
}

// Edges first, then the groups in their order.
void LmProblem::assemble() {
    for (const uint32_t block : unconnected_)
        std::fill_n(&trial_.lower[block * kBlockFloats], kBlockFloats, 0.0f);
    for (size_t i = 0; i < pattern_.rows(); ++i) {
        const float* own = &edge_nodes_[i * kNodeFloats];
        float* block = &trial_.diagonal[i * kBlockFloats];
        constexpr size_t kUpper[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
        for (size_t r = 0; r < 3; ++r)
            for (size_t c = 0; c < 3; ++c) {
                block[6 * c + r] = own[kUpper[3 * r + c]];
                block[6 * (3 + c) + r] = block[6 * r + 3 + c] = own[6 + 3 * r + c];
                block[6 * (3 + c) + 3 + r] = own[15 + kUpper[3 * r + c]];
            }
        std::copy_n(own + 21, 6, &trial_.gradient[6 * i]);
    }
    for (size_t g = 0; g < sums_.size(); ++g) {
        const auto& node = groups_.groups()[g].node;
        size_t pair = 0;
        for (size_t k = 0; k < kSkin; ++k)
            for (size_t l = 0; l <= k; ++l, ++pair) {
                if (k != l && node[k] == node[l])
                    continue;  // a repeated control point has no weight
                float* block = (k == l ? trial_.diagonal.data() : trial_.lower.data()) +
                               size_t(places_[g][pair]) * kBlockFloats;
                for (size_t i = 0; i < 36; ++i) block[i] += sums_[g].blocks[pair][i];
            }
        for (size_t k = 0; k < kSkin; ++k)
            for (size_t i = 0; i < 6; ++i)
                trial_.gradient[6 * size_t(node[k]) + i] += sums_[g].gradient[6 * k + i];
    }
}

LmSums LmProblem::total() const {
    LmSums sums;
    const auto add = [](LmSums::Term& term, const LmGroupSums::Term& part) {
        term.cost += double(part.cost);
        term.weights += double(part.weights);
        term.squares += double(part.squares);
        term.count += part.count;
    };
    for (const LmGroupSums& group : sums_) {
        add(sums.icp, group.icp);
        add(sums.match, group.match);
        add(sums.patch, group.patch);
        sums.missing += double(group.missing);
    }
    sums.arap = arap_cost_;
    return sums;
}

}  // namespace defrec::cpu
