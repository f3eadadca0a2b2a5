// See body_piece.hpp.
#include "sdk/body/body_piece.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "sdk/body/decisions.hpp"
#include "sdk/body/stiffness.hpp"

namespace defrec {
namespace {

using decisions::BodyStiffness;

using Terms = std::vector<Lattice::Term>;
using RightSides = StiffnessFactor::RightSides;

Terms merged(std::vector<std::pair<int32_t, double>> sums, double scale) {
    std::sort(sums.begin(), sums.end());
    Terms terms;
    for (const auto& [node, weight] : sums) {
        if (terms.empty() || terms.back().node != node) terms.push_back({node, 0});
        terms.back().weight += scale * weight;
    }
    return terms;
}

// A handle's mean displacement as a sum over free nodes; empty where the body does not reach it.
Terms terms_of(const Lattice& lattice, const Handle& handle) {
    constexpr size_t kEnough = 16;  // vertices stand for all
    std::vector<std::pair<int32_t, double>> sums;
    size_t used = 0;
    const size_t step = (handle.places.size() + kEnough - 1) / kEnough;
    for (size_t i = 0; i < handle.places.size(); i += step) {
        // The surface may leave the body by a little.
        const Lattice::Place place =
            lattice.find_near(handle.places[i].cast<double>(), 2 * lattice.step());
        if (place.cell < 0) continue;
        ++used;
        const auto weights = place.weights();
        const Lattice::Cell& cell = lattice.cells()[static_cast<size_t>(place.cell)];
        for (size_t k = 0; k < 8; ++k)
            for (const Lattice::Term& term : lattice.terms(node_of(cell, k)))
                sums.emplace_back(term.node, weights[k] * term.weight);
    }
    return merged(std::move(sums), 1.0 / static_cast<double>(std::max<size_t>(1, used)));
}

// Springs that pull at the free nodes.
struct Springs {
    double handle = 0;             // stiffness of each handle's
    std::vector<Terms> handles;    // the nodes that each handle pulls at
    std::vector<double> supports;  // stiffness, per node
};

Springs springs_of(const Lattice& lattice, std::span<const Handle> handles,
                   const SupportStiffness& support) {
    Springs springs{BodyStiffness::kData * lattice.step(), {}, {}};
    for (const Handle& handle : handles) springs.handles.push_back(terms_of(lattice, handle));
    const std::vector<double> area = boundary_areas(lattice);
    for (size_t node = 0; node < area.size(); ++node)
        springs.supports.push_back(support(lattice.nodes()[node], area[node]));
    return springs;
}

Eigen::SparseMatrix<double> stiffness_of(const Lattice& lattice, double poisson_ratio,
                                         const Springs& springs) {
    StiffnessSum sum(lattice.free_nodes());
    sum.add_cells(lattice, poisson_ratio);
    for (const Terms& terms : springs.handles)
        for (const Lattice::Term& row : terms)
            for (const Lattice::Term& column : terms)
                sum.add(row.node, column.node,
                        springs.handle * row.weight * column.weight * Eigen::Matrix3d::Identity());
    for (size_t node = 0; node < springs.supports.size(); ++node) {
        const auto index = static_cast<int32_t>(node);
        sum.add(index, index, springs.supports[node] * Eigen::Matrix3d::Identity());
    }
    return sum.matrix();
}

// Displacements of the free nodes, three rows each: for displacements of the handles, three columns
// each, and of the frame of the supports (BodyPiece::support_response()).
struct Responses {
    Eigen::MatrixXf handles;
    Eigen::Matrix<float, Eigen::Dynamic, 12> supports;
};

// The right sides of up to 16 columns of responses, those of the handles first.
void set_forces(const Lattice& lattice, const Springs& springs, const Eigen::VectorXi& order,
                size_t begin, RightSides& x) {
    const size_t handle_columns = 3 * springs.handles.size(),
                 end = std::min(begin + 16, handle_columns + 12);
    x.setZero();
    for (size_t column = begin; column < end; ++column) {
        const auto slot = static_cast<Eigen::Index>(column - begin);
        if (column < handle_columns) {
            for (const Lattice::Term& term : springs.handles[column / 3])
                x(order[3 * term.node + static_cast<int32_t>(column % 3)], slot) =
                    static_cast<float>(springs.handle * term.weight);
            continue;
        }
        const size_t entry = column - handle_columns, axis = entry % 4;
        for (size_t node = 0; node < springs.supports.size(); ++node) {
            const double along =
                axis == 3 ? 1 : lattice.nodes()[node][static_cast<Eigen::Index>(axis)];
            x(order[static_cast<Eigen::Index>(3 * node + entry / 4)], slot) =
                static_cast<float>(springs.supports[node] * along);
        }
    }
}

// Empty where it is no longer wanted.
std::optional<Responses> solve(const Lattice& lattice, const Springs& springs,
                               const StiffnessFactor& factor,
                               const std::function<bool()>& is_wanted) {
    const auto rows = static_cast<Eigen::Index>(3 * springs.supports.size()),
               handle_columns = static_cast<Eigen::Index>(3 * springs.handles.size());
    std::optional<Responses> responses(std::in_place);
    responses->handles.resize(rows, handle_columns);
    responses->supports.resize(rows, 12);
    const Eigen::Index columns = handle_columns + responses->supports.cols();
    RightSides x(rows, 16);
    for (Eigen::Index begin = 0; begin < columns; begin += 16) {
        if (!is_wanted()) return std::nullopt;
        set_forces(lattice, springs, factor.order(), static_cast<size_t>(begin), x);
        factor.solve(x);
        const Eigen::Index end = std::min(begin + 16, columns);
        for (Eigen::Index column = begin; column < end; ++column)
            for (Eigen::Index i = 0; i < rows; ++i) {
                const float value = x(factor.order()[i], column - begin);
                if (column < handle_columns)
                    responses->handles(i, column) = value;
                else
                    responses->supports(i, column - handle_columns) = value;
            }
    }
    return responses;
}

}  // namespace

BodyPiece::BodyPiece(std::vector<Handle> handles, Lattice lattice, double poisson_ratio,
                     const SupportStiffness& support, const std::function<bool()>& is_wanted)
    : handles_(std::move(handles)), lattice_(std::move(lattice)) {
    const Springs springs = springs_of(lattice_, handles_, support);
    const Eigen::SparseMatrix<double> stiffness = stiffness_of(lattice_, poisson_ratio, springs);
    if (!is_wanted()) return;
    const StiffnessFactor factor(stiffness);
    std::optional<Responses> responses = solve(lattice_, springs, factor, is_wanted);
    if (!responses) return;
    support_response_ = std::move(responses->supports);
    set_force_response(springs.handles, responses->handles);
    support_share_.resize(lattice_.free_nodes());
    for (size_t node = 0; node < support_share_.size(); ++node) {
        float share = 0;
        for (int axis = 0; axis < 3; ++axis)
            share +=
                support_response_(static_cast<Eigen::Index>(3 * node) + axis, 4 * axis + 3) / 3;
        support_share_[node] = std::clamp(share, 0.0f, 1.0f);
    }
    keep_links(responses->handles);
    is_complete_ = true;
}

void BodyPiece::set_force_response(std::span<const std::vector<Lattice::Term>> handle_terms,
                                   const Eigen::MatrixXf& response) {
    force_response_.setIdentity(response.cols(), response.cols());
    for (size_t i = 0; i < handles_.size(); ++i)
        for (const Lattice::Term& term : handle_terms[i])
            force_response_.middleRows<3>(static_cast<Eigen::Index>(3 * i)) -=
                static_cast<float>(term.weight) * response.middleRows<3>(3 * term.node);
    Eigen::Matrix3Xd places(3, static_cast<Eigen::Index>(handles_.size()));
    for (size_t i = 0; i < handles_.size(); ++i)
        places.col(static_cast<Eigen::Index>(i)) = handles_[i].position;
    force_slope_ = (force_response_.cast<double>() * motion_slope(places)).cast<float>();
}

// Handles that hardly count for a node are left out, and what they would do is given to the one
// that counts most: in sum the responses stay what they are.
void BodyPiece::keep_links(const Eigen::MatrixXf& response) {
    const size_t nodes = lattice_.free_nodes();
    const float least = BodyStiffness::kMinInfluence / static_cast<float>(handles_.size());
    std::vector<float> size(handles_.size());
    first_link_.assign(1, 0);
    for (size_t node = 0; node < nodes; ++node) {
        float sum = 0;
        const auto block = [&](size_t handle) {
            return response.block<3, 3>(static_cast<Eigen::Index>(3 * node),
                                        static_cast<Eigen::Index>(3 * handle));
        };
        for (size_t handle = 0; handle < size.size(); ++handle)
            sum += size[handle] = block(handle).norm();
        Eigen::Matrix3f left_out = Eigen::Matrix3f::Zero();
        size_t largest = links_.size();
        float kept = 0;
        for (size_t handle = 0; handle < size.size(); ++handle) {
            if (size[handle] <= least * sum) {
                left_out += block(handle);
                continue;
            }
            kept += size[handle];
            links_.push_back({static_cast<int32_t>(handle), size[handle], block(handle)});
            if (size[handle] > links_[largest].influence) largest = links_.size() - 1;
        }
        for (size_t k = first_link_.back(); k < links_.size(); ++k)
            links_[k].influence /= std::max(kept, 1e-12f);
        if (largest < links_.size()) links_[largest].response += left_out;
        first_link_.push_back(links_.size());
    }
    links_.shrink_to_fit();
}

}  // namespace defrec
