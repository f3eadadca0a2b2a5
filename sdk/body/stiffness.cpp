// See stiffness.hpp.
#include "sdk/body/stiffness.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>

#include "sdk/base/util/error.hpp"
#include "sdk/body/elasticity.hpp"

namespace defrec {

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

void StiffnessSum::add(int32_t row, int32_t column, const Eigen::Matrix3d& block) {
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

void StiffnessSum::add_cells(const Lattice& lattice, double poisson_ratio) {
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
                        add(row.node, column.node, row.weight * column.weight * block);
            }
    }
}

Eigen::SparseMatrix<double> StiffnessSum::matrix() const {
    Eigen::Index values = 0;
    for (const auto& entries : columns_) values += 9 * static_cast<Eigen::Index>(entries.size());
    const auto size = static_cast<Eigen::Index>(3 * columns_.size());
    Eigen::SparseMatrix<double> result(size, size);
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

StiffnessFactor::StiffnessFactor(const Eigen::SparseMatrix<double>& stiffness) {
    Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor;
    factor.compute(stiffness);
    if (factor.info() != Eigen::Success)
        fail(DEFREC_ERROR_UNSUPPORTED, "the body's equations have no solution");
    lower_ = Eigen::SparseMatrix<double>(factor.matrixL()).cast<float>();
    order_ = factor.permutationP().indices();
}

// Columns of the factor begin with the diagonal.
void StiffnessFactor::solve(RightSides& x) const {
    const auto* first = lower_.outerIndexPtr();
    const auto* row = lower_.innerIndexPtr();
    const float* value = lower_.valuePtr();
    for (Eigen::Index column = 0; column < lower_.cols(); ++column) {
        const auto at = x.row(column) / value[first[column]];
        const Eigen::Matrix<float, 1, 16> solved = at;
        x.row(column) = solved;
        for (auto k = first[column] + 1; k < first[column + 1]; ++k)
            x.row(row[k]) -= value[k] * solved;
    }
    for (Eigen::Index column = lower_.cols() - 1; column >= 0; --column) {
        Eigen::Matrix<float, 1, 16> sum = x.row(column);
        for (auto k = first[column] + 1; k < first[column + 1]; ++k)
            sum -= value[k] * x.row(row[k]);
        x.row(column) = sum / value[first[column]];
    }
}

}  // namespace defrec
