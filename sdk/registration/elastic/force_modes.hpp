// The shapes that an organ may take: how it gives way, as an elastic body, to smooth forces on its
// surface that are in balance.
#pragma once
#include <Eigen/Core>
#include <memory>

#include "sdk/base/os/services.hpp"
#include "sdk/body/lattice.hpp"
#include "sdk/registration/model_surface.hpp"

namespace defrec {

class ForceModes {
  public:
    // A displacement in mm, one column for each mode.
    using Shifts = Eigen::Matrix<double, 3, Eigen::Dynamic>;

    // helpers: whose threads take part; null: the caller's alone. Throws
    // Error(DEFREC_ERROR_ARGUMENT), with a message that begins with "the model", for a surface that
    // is not the closed surface of one body.
    ForceModes(const ModelSurface& surface, const Services* helpers);

    Eigen::Index count() const { return stiffness_.size(); }
    // Twice the elastic energy of each mode, whose displacement over the surface is 1 mm, root mean
    // square, in units of Young's modulus; rising. Modes are orthogonal in both, and none moves the
    // body as a whole.
    const Eigen::VectorXd& stiffness() const { return stiffness_; }

    // Displacement of a place at rest, which is that of the nearest place where it lies outside.
    Shifts at(const Eigen::Vector3d& place) const;
    // The displacements of the lattice's nodes, and of a place that lies in it.
    Eigen::VectorXd node_shifts(const Eigen::VectorXd& coefficients) const;
    Lattice::Place find(const Eigen::Vector3d& place) const;
    Eigen::Vector3d shift(const Lattice::Place& at, const Eigen::VectorXd& node_shifts) const;
    // The largest principal strain of a cell, stretched or compressed, and the root mean square of
    // the cells' strains (Frobenius norm).
    double largest_strain(const Eigen::VectorXd& node_shifts) const;
    double rms_strain(const Eigen::VectorXd& node_shifts) const;

  private:
    // The mean of a cell.
    Eigen::Matrix3d strain(const Lattice::Cell& cell, const Eigen::VectorXd& node_shifts) const;

    std::unique_ptr<const Lattice> lattice_;
    Eigen::MatrixXd nodes_;  // three rows for each node, one column for each mode
    Eigen::VectorXd stiffness_;
};

}  // namespace defrec
