// See body_piece.hpp.
#include "sdk/body/body_piece.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "sdk/base/util/error.hpp"
#include "sdk/body/decisions.hpp"
#include "sdk/body/elasticity.hpp"

namespace defrec {
namespace {

using decisions::BodyStiffness;

using Sparse = Eigen::SparseMatrix<double>;
using Terms = std::vector<Lattice::Term>;

size_t node_of(const Lattice::Cell& cell, size_t corner) {
    return static_cast<size_t>(cell.node[corner]);
}

// The area of the body's boundary that counts for each free node, mm^2.
std::vector<double> boundary_areas(const Lattice& lattice) {
    std::vector<double> area(lattice.free_nodes(), 0);
    for (const Lattice::Cell& cell : lattice.cells()) {
        const double edge = lattice.edge(cell);
        const Eigen::Vector3d centre =
            lattice.nodes()[node_of(cell, 0)] + Eigen::Vector3d::Constant(edge / 2);
        for (int face = 0; face < 6; ++face) {
            const int axis = face / 2;
            const bool is_high = face % 2 != 0;
            Eigen::Vector3d beyond = centre;
            beyond[axis] += (is_high ? 0.5 : -0.5) * (edge + lattice.step());
            if (lattice.find(beyond).cell >= 0) continue;
            for (size_t corner = 0; corner < 8; ++corner) {
                if (((corner >> axis & 1) != 0) != is_high) continue;
                for (const Lattice::Term& term : lattice.terms(node_of(cell, corner)))
                    area[static_cast<size_t>(term.node)] += term.weight * (edge * edge / 4);
            }
        }
    }
    return area;
}

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

// The lower half of the stiffness matrix, compressed columns, in 3 x 3 blocks of nodes.
class Assembly {
  public:
    explicit Assembly(size_t nodes) : columns_(nodes) {}

    // Adds a block's values for rows of node row and columns of node column.
    void add(int32_t row, int32_t column, const Eigen::Matrix3d& block) {
        if (row < column) return;
        auto& entries = columns_[static_cast<size_t>(column)];
        const auto found =
            std::lower_bound(entries.begin(), entries.end(), row,
                             [](const Block& entry, int32_t wanted) { return entry.row < wanted; });
        if (found != entries.end() && found->row == row)
            found->values += block;
        else
            entries.insert(found, {row, block});
    }
    Sparse matrix() const {
        Eigen::Index values = 0;
        for (const auto& entries : columns_)
            values += 9 * static_cast<Eigen::Index>(entries.size());
        const auto size = static_cast<Eigen::Index>(3 * columns_.size());
        Sparse result(size, size);
        result.reserve(values);
        for (size_t column = 0; column < columns_.size(); ++column)
            for (int j = 0; j < 3; ++j) {
                const auto index = static_cast<Eigen::Index>(3 * column) + j;
                result.startVec(index);
                for (const Block& block : columns_[column])
                    for (int i = 0; i < 3; ++i)
                        if (const Eigen::Index at = 3 * block.row + i; at >= index)
                            result.insertBack(at, index) = block.values(i, j);
            }
        result.finalize();
        return result;
    }

  private:
    struct Block {
        int32_t row;
        Eigen::Matrix3d values;
    };
    std::vector<std::vector<Block>> columns_;
};

void add_cells(const Lattice& lattice, double poisson_ratio, Assembly& sum) {
    const CubeStiffness cube = cube_stiffness(poisson_ratio);
    for (const Lattice::Cell& cell : lattice.cells()) {
        const double scale = cell.stiffness * lattice.edge(cell);
        for (int a = 0; a < 8; ++a)
            for (int b = 0; b < 8; ++b) {
                const Eigen::Matrix3d block = scale * cube.block<3, 3>(3 * a, 3 * b);
                for (const Lattice::Term& row :
                     lattice.terms(node_of(cell, static_cast<size_t>(a))))
                    for (const Lattice::Term& column :
                         lattice.terms(node_of(cell, static_cast<size_t>(b))))
                        sum.add(row.node, column.node, row.weight * column.weight * block);
            }
    }
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

Sparse stiffness_of(const Lattice& lattice, double poisson_ratio, const Springs& springs) {
    Assembly sum(lattice.free_nodes());
    add_cells(lattice, poisson_ratio, sum);
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

// The factor L of a stiffness matrix L L^T whose rows and columns are reordered.
struct Factor {
    Eigen::SparseMatrix<float> lower;
    Eigen::VectorXi order;  // where each row has come to
};

Factor factor_of(const Sparse& stiffness) {
    Eigen::SimplicialLLT<Sparse, Eigen::Lower> factor;
    factor.compute(stiffness);
    if (factor.info() != Eigen::Success)
        fail(DEFREC_ERROR_UNSUPPORTED, "the body's equations have no solution");
    return {Sparse(factor.matrixL()).cast<float>(), factor.permutationP().indices()};
}

// As many right sides as fit into vector registers and caches; one a column.
using RightSides = Eigen::Matrix<float, Eigen::Dynamic, 16, Eigen::RowMajor>;

// Takes right sides to solutions with a factor L of L L^T, whose columns begin with the diagonal.
void substitute(const Eigen::SparseMatrix<float>& lower, RightSides& x) {
    const auto* first = lower.outerIndexPtr();
    const auto* row = lower.innerIndexPtr();
    const float* value = lower.valuePtr();
    for (Eigen::Index column = 0; column < lower.cols(); ++column) {
        const auto at = x.row(column) / value[first[column]];
        const Eigen::Matrix<float, 1, 16> solved = at;
        x.row(column) = solved;
        for (auto k = first[column] + 1; k < first[column + 1]; ++k)
            x.row(row[k]) -= value[k] * solved;
    }
    for (Eigen::Index column = lower.cols() - 1; column >= 0; --column) {
        Eigen::Matrix<float, 1, 16> sum = x.row(column);
        for (auto k = first[column] + 1; k < first[column + 1]; ++k)
            sum -= value[k] * x.row(row[k]);
        x.row(column) = sum / value[first[column]];
    }
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
std::optional<Responses> solve(const Lattice& lattice, const Springs& springs, const Factor& factor,
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
        set_forces(lattice, springs, factor.order, static_cast<size_t>(begin), x);
        substitute(factor.lower, x);
        const Eigen::Index end = std::min(begin + 16, columns);
        for (Eigen::Index column = begin; column < end; ++column)
            for (Eigen::Index i = 0; i < rows; ++i) {
                const float value = x(factor.order[i], column - begin);
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
    const Sparse stiffness = stiffness_of(lattice_, poisson_ratio, springs);
    if (!is_wanted()) return;
    const Factor factor = factor_of(stiffness);
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
