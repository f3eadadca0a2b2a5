// The stiffness matrix of a lattice, and its solution for many right sides.
#pragma once
#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstdint>
#include <vector>

#include "sdk/body/lattice.hpp"

namespace defrec {

// The free node or the one that hangs at a corner of a cell.
inline size_t node_of(const Lattice::Cell& cell, size_t corner) {
    return static_cast<size_t>(cell.node[corner]);
}

// The area of the body's boundary that counts for each free node, mm^2.
std::vector<double> boundary_areas(const Lattice& lattice);

// The lower half of the stiffness matrix of the free nodes, compressed columns, in 3 x 3 blocks of
// nodes; Young's modulus 1.
class StiffnessSum {
  public:
    explicit StiffnessSum(size_t nodes) : columns_(nodes) {}

    // Adds a block's values for rows of node row and columns of node column.
    void add(int32_t row, int32_t column, const Eigen::Matrix3d& block);
    // Adds what all cells of a lattice resist.
    void add_cells(const Lattice& lattice, double poisson_ratio);
    Eigen::SparseMatrix<double> matrix() const;

  private:
    struct Block {
        int32_t row;
        Eigen::Matrix3d values;
    };
    std::vector<std::vector<Block>> columns_;
};

// The factor L of a stiffness matrix L L^T whose rows and columns are reordered.
class StiffnessFactor {
  public:
    // As many right sides as fit into vector registers and caches; one a column.
    using RightSides = Eigen::Matrix<float, Eigen::Dynamic, 16, Eigen::RowMajor>;

    // Throws Error(DEFREC_ERROR_UNSUPPORTED) for a matrix that is not positive definite.
    explicit StiffnessFactor(const Eigen::SparseMatrix<double>& stiffness);

    // Places of the rows of the matrix in right sides and solutions.
    const Eigen::VectorXi& order() const { return order_; }
    // Takes right sides to solutions.
    void solve(RightSides& x) const;

  private:
    Eigen::SparseMatrix<float> lower_;
    Eigen::VectorXi order_;
};

}  // namespace defrec
