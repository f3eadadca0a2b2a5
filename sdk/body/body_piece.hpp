// The elastic body under one piece of the surface: what its lattice does for what the surface does.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "include/defrec_c.h"
#include "sdk/body/deep_motion.hpp"
#include "sdk/body/lattice.hpp"

namespace defrec {

// A part of the surface about as large as a cell. The body is given the mean displacement of its
// vertices.
struct Handle {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();  // mean of its vertices at rest, mm
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    std::vector<uint32_t> vertices;
    std::vector<Eigen::Vector3f> places;  // of the vertices at rest, mm
};

inline Eigen::Vector3d position_of(const defrec_surface_point& vertex) {
    return Eigen::Map<const Eigen::Vector3f>(vertex.position).cast<double>();
}

// Springs that join the body to a rigid frame: stiffness, divided by Young's modulus, of a node for
// which a boundary of that area (mm^2) of the body counts.
using SupportStiffness = std::function<double(const Eigen::Vector3d& place, double area)>;

class BodyPiece {
  public:
    // The effect of a handle on a free node.
    struct Link {
        int32_t handle;
        float influence;           // how much of what the node depends on, of sum 1
        Eigen::Matrix3f response;  // displacement of the node for that of the handle
    };

    // is_wanted: asked now and then; false ends it with is_complete() false.
    BodyPiece(std::vector<Handle> handles, Lattice lattice, double poisson_ratio,
              const SupportStiffness& support, const std::function<bool()>& is_wanted);

    bool is_complete() const { return is_complete_; }
    const Lattice& lattice() const { return lattice_; }
    std::span<const Handle> handles() const { return handles_; }
    // The handles that count for a free node; responses and support_response make rigid motions
    // exact to first order.
    std::span<const Link> links(size_t node) const {
        return {links_.data() + first_link_[node], first_link_[node + 1] - first_link_[node]};
    }
    // Displacements of the free nodes, three rows each, for an affine displacement a x + b of the
    // frame that supports join the body to: columns are a's first row and b's first component, and
    // so on.
    const Eigen::Matrix<float, Eigen::Dynamic, 12>& support_response() const {
        return support_response_;
    }
    // How much of it a free node follows, 0..1.
    float support_share(size_t node) const { return support_share_[node]; }
    // How far the handles' springs give way for what is given to the handles; symmetric.
    const Eigen::MatrixXf& force_response() const { return force_response_; }
    // The same for a small rigid motion of all handles.
    const Eigen::MatrixXf& force_slope() const { return force_slope_; }

  private:
    void set_force_response(std::span<const std::vector<Lattice::Term>> handle_terms,
                            const Eigen::MatrixXf& response);
    void keep_links(const Eigen::MatrixXf& response);

    std::vector<Handle> handles_;
    Lattice lattice_;
    std::vector<size_t> first_link_;
    std::vector<Link> links_;
    Eigen::Matrix<float, Eigen::Dynamic, 12> support_response_;
    std::vector<float> support_share_;
    Eigen::MatrixXf force_response_;
    Eigen::MatrixXf force_slope_;
    bool is_complete_ = false;
};

}  // namespace defrec
