// What a body consists of: where there is tissue, how stiff it is, and what holds it.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/body/body.hpp"

namespace defrec {

// Parts of the surface about step mm across, of each piece. The vertices that a cut passes are of
// none.
std::vector<std::vector<Handle>> make_handles(const BodySurface& surface, double step);
// A step that gives about as many handles as a body is computed with in a second or two.
double handle_step(const BodySurface& surface);

// The nearest of some handles; -1: there are none.
int32_t nearest_handle(std::span<const Handle> handles, const Eigen::Vector3d& place);

// The body under one piece of the surface. Borrows what it is made of.
class BodyShape {
  public:
    BodyShape(const BodySurface& surface, const BodyDescription& description,
              std::span<const std::vector<Handle>> handles, size_t piece, double step);

    Lattice::Request request(const std::function<bool()>& is_wanted) const;
    SupportStiffness support() const;

  private:
    double share(const Eigen::Vector3d& centre, double edge) const;
    double stiffness(const Eigen::Vector3d& centre, double edge) const;
    bool is_cut(const Eigen::Vector3d& centre, double edge) const;
    bool is_held() const;
    bool is_beneath(const Eigen::Vector3d& place) const;

    const BodyDescription& description_;
    std::span<const std::vector<Handle>> handles_;  // of all pieces
    size_t piece_;
    double step_, depth_mm_, margin_mm_;
    Eigen::Vector3d low_, high_;
    struct CutSegment {
        Eigen::Vector3d from, to, down;  // down: into the tissue
        double width;                    // of a cube of edge 1 across the cut
    };
    std::vector<CutSegment> cuts_;
};

}  // namespace defrec
