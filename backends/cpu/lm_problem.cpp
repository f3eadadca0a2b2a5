// Assembly of the system from the groups and the edges.
#include "backends/cpu/lm_problem.hpp"

#include <numeric>

namespace defrec::cpu {

LmProblem::LmProblem(const defrec_lm_params& params, const LmTemplate& surface, const Host& host)
    : params_(params),
      surface_(surface),
      host_(host),
      pattern_(surface.pattern, host),
      groups_(surface, host),
      edges_(surface, pattern_, host),
      places_(HostAllocator<GroupPlaces>(host)),
      unconnected_(HostAllocator<uint32_t>(host)),
      sums_(groups_.groups().size(), HostAllocator<LmGroupSums>(host)),
      row_start_(HostAllocator<uint32_t>(host)),
      row_groups_(HostAllocator<RowGroup>(host)),
      scratch_(kTasks * lm_scratch_floats(groups_), HostAllocator<float>(host)),
      offsets_(groups_.places(), HostAllocator<int32_t>(host)),
      motions_(surface.nodes.size(), HostAllocator<NodeMotion>(host)),
      poses_(surface.nodes.size() * 8, HostAllocator<float>(host)),
      edge_nodes_(edges_.piece_nodes * kNodeFloats, HostAllocator<float>(host)),
      data_(surface.nodes.size(), HostAllocator<double>(host)),
      arap_costs_(edges_.pieces.size(), HostAllocator<double>(host)),
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
        for (size_t k = 0; k < kBlendNodes; ++k)
            for (size_t l = 0; l <= k; ++l, ++pair)
                places[pair] = uint32_t(k == l || group.node[k] == group.node[l]
                                            ? size_t(group.node[k])
                                            : pattern_.find(group.node[k], group.node[l]));
    }
    list_row_groups();
}

void LmProblem::set_frame(const LmFrame& frame) {
    image_ = frame.disparity;
    const size_t count = sums_.size();
    host_.parallel_for(kTasks, [&](size_t i) {
        groups_.set_frame(params_, frame, count * i / kTasks, count * (i + 1) / kTasks);
    });
}

LmSums LmProblem::begin(std::span<const NodePose<double>> nodes) {
    set_nodes(nodes);
    host_.parallel_for(kTasks, [this](size_t i) { sum_surface(i, true); });
    measure_data();
    host_.parallel_for(edges_.pieces.size(), [this](size_t i) {
        weigh_edges(i);
        sum_arap(i, true);
    });
    host_.parallel_for(workspace_.parts.size(), [this](size_t i) { assemble(i); });
    accept();
    return total();
}

LmSums LmProblem::evaluate(std::span<const NodePose<double>> nodes, bool linearise) {
    set_nodes(nodes);
    const size_t pieces = edges_.pieces.size();
    host_.parallel_for(pieces + kTasks, [&](size_t i) {
        if (i < pieces)
            sum_arap(i, linearise);
        else
            sum_surface(i - pieces, linearise);
    });
    if (linearise) host_.parallel_for(workspace_.parts.size(), [this](size_t i) { assemble(i); });
    return total();
}

bool LmProblem::solve(double lambda, double* step) {
    const uint32_t iterations = gradient_steps(params_);
    if (!solve_system({&pattern_, &present_, &workspace_, &host_, float(lambda), iterations}))
        return false;
    std::copy_n(workspace_.x.begin(), 6 * pattern_.rows(), step);
    return true;
}

void LmProblem::set_nodes(std::span<const NodePose<double>> nodes) {
    for_each_item(host_, nodes.size(), [&](size_t i) {
        const auto& [q, p] = nodes[i];
        motions_[i].set(from_rigid(q, p - rotate(q, surface_.nodes[i])), surface_.nodes[i]);
        const double pose[8] = {q.w, q.x, q.y, q.z, p.x, p.y, p.z, 0};
        std::copy(pose, pose + 8, &poses_[8 * i]);
    });
}

void LmProblem::list_row_groups() {
    row_start_.assign(pattern_.rows() + 1, 0);
    const auto each = [this](auto&& body) {
        for (size_t g = 0; g < groups_.groups().size(); ++g) {
            const auto& node = groups_.groups()[g].node;
            for (size_t k = 0; k < kBlendNodes; ++k)
                if (k == 0 || node[k] != node[k - 1])  // a repeated control point has no weight
                    body(size_t(node[k]), RowGroup{uint32_t(g), uint32_t(k)});
        }
    };
    each([this](size_t row, RowGroup) { ++row_start_[row + 1]; });
    std::partial_sum(row_start_.begin(), row_start_.end(), row_start_.begin());
    row_groups_.resize(row_start_.back());
    std::vector<uint32_t> next(row_start_.begin(), row_start_.end() - 1);
    each([&](size_t row, RowGroup entry) { row_groups_[next[row]++] = entry; });
}

void LmProblem::sum_surface(size_t task, bool linearise) {
    const size_t count = sums_.size(), room = scratch_.size() / kTasks;
    const size_t first = count * task / kTasks, last = count * (task + 1) / kTasks;
    const LmGroupTask work{&groups_,        motions_.data(), &params_,
                           image_,          linearise,       scratch_.data() + task * room,
                           offsets_.data(), sums_.data()};
    sum_groups(work, first, last);
    LmSums& sums = task_sums_[task] = {};
    const auto add = [](LmSums::Term& term, const LmGroupSums::Term& part) {
        term.cost += double(part.cost);
        term.weights += double(part.weights);
        term.squares += double(part.squares);
        term.count += part.count;
    };
    for (size_t g = first; g < last; ++g) {
        add(sums.icp, sums_[g].icp);
        add(sums.match, sums_[g].match);
        add(sums.patch, sums_[g].patch);
        sums.missing += double(sums_[g].missing);
    }
}

void LmProblem::sum_arap(size_t piece, bool linearise) {
    const LmConstants constants = constants_of(params_);
    const LmEdgePiece& here = edges_.pieces[piece];
    float* nodes = edge_nodes_.data() + here.offset * kNodeFloats;
    if (linearise) std::fill_n(nodes, (here.last_node - here.first_node) * kNodeFloats, 0.0f);
    arap_costs_[piece] =
        sum_edges({&edges_, &here, poses_.data(), constants.length_weight, constants.angle_weight,
                   constants.rotation_weight, linearise, trial_.lower.data(), nodes});
}

// The weight of the ARAP term follows that of the data (paper, below its equation 1).
void LmProblem::measure_data() {
    std::fill(data_.begin(), data_.end(), 0.0);
    for (size_t g = 0; g < sums_.size(); ++g)
        for (size_t k = 0; k < kBlendNodes; ++k)
            data_[size_t(groups_.groups()[g].node[k])] += double(sums_[g].data[k]);
    double sum = 0, squares = 0;
    for (const double weight : data_) {
        sum += weight;
        squares += weight * weight;
    }
    usual_data_ = sum > 0 ? squares / sum : 0;
}

void LmProblem::weigh_edges(size_t piece) {
    for (size_t i = edges_.pieces[piece].first; i < edges_.pieces[piece].last; ++i) {
        const double data = (data_[size_t(edges_.a[i])] + data_[size_t(edges_.b[i])]) / 2;
        edges_.weight[i] = edges_.share[i] * params_.arap_weight * float((data + usual_data_) / 2);
    }
}

// Edges first, piece by piece, then the groups in their order.
void LmProblem::assemble(size_t part) {
    const size_t first = workspace_.parts[part].first, last = workspace_.parts[part].last;
    const auto here = std::lower_bound(unconnected_.begin(), unconnected_.end(),
                                       pattern_.start[first]),
               end = std::lower_bound(here, unconnected_.end(), pattern_.start[last]);
    for (auto block = here; block != end; ++block)
        std::fill_n(&trial_.lower[*block * kBlockFloats], kBlockFloats, 0.0f);
    for (size_t i = first; i < last; ++i) {
        std::array<float, kNodeFloats> own{};
        for (const LmEdgePiece& piece : edges_.pieces) {
            if (i < piece.first_node || i >= piece.last_node) continue;
            const float* more = &edge_nodes_[(piece.offset + i - piece.first_node) * kNodeFloats];
            for (size_t k = 0; k < kNodeFloats; ++k) own[k] += more[k];
        }
        float* block = &trial_.diagonal[i * kBlockFloats];
        constexpr size_t kUpper[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
        for (size_t r = 0; r < 3; ++r)
            for (size_t c = 0; c < 3; ++c) {
                block[6 * c + r] = own[kUpper[3 * r + c]];
                block[6 * (3 + c) + r] = block[6 * r + 3 + c] = own[6 + 3 * r + c];
                block[6 * (3 + c) + 3 + r] = own[15 + kUpper[3 * r + c]];
            }
        std::copy_n(own.data() + 21, 6, &trial_.gradient[6 * i]);
        add_groups(
            {std::span(row_groups_).subspan(row_start_[i], row_start_[i + 1] - row_start_[i]),
             groups_.groups().data(), sums_.data(), places_.data(), trial_.lower.data(),
             trial_.diagonal.data(), &trial_.gradient[6 * i]});
    }
}

LmSums LmProblem::total() const {
    LmSums sums;
    const auto add = [](LmSums::Term& term, const LmSums::Term& part) {
        term.cost += part.cost;
        term.weights += part.weights;
        term.squares += part.squares;
        term.count += part.count;
    };
    for (const LmSums& task : task_sums_) {
        add(sums.icp, task.icp);
        add(sums.match, task.match);
        add(sums.patch, task.patch);
        sums.missing += task.missing;
    }
    sums.arap = std::accumulate(arap_costs_.begin(), arap_costs_.end(), 0.0);
    return sums;
}

}  // namespace defrec::cpu
