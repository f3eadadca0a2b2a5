// The elastic body beneath a template's surface, worked out once for all frames: pieces of the
// surface have bodies of their own.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "sdk/body/body_description.hpp"
#include "sdk/body/body_piece.hpp"

namespace defrec {

// The surface at rest. Vertices of later templates that grew from it follow these.
struct BodySurface {
    std::span<const defrec_surface_point> vertices;
    std::span<const uint8_t> piece;  // per vertex
    size_t pieces = 1;
    std::span<const defrec_cut_point> cuts;
};

// Where a point lies with respect to a body.
struct BodyPoint {
    static constexpr size_t kHandles = 4;
    uint8_t piece = 0;
    Lattice::Place place;  // the nearest of the body; cell -1: there is none near
    double depth_mm = 0;   // beneath the surface; negative: in front of it
    double beyond_mm = 0;  // from the body to the point
    // The nearest handles, with weights of sum 1 that fall off with the distance.
    std::array<int32_t, kHandles> handle{};
    std::array<float, kHandles> weight{};
    double fade =
        1;  // of what the lattice is too coarse for: it ends about a cell from the surface
};

class Body {
  public:
    // nullptr where is_wanted has said false. Throws Error(DEFREC_ERROR_UNSUPPORTED) where no body
    // can be made of it.
    static std::shared_ptr<const Body> make(const BodySurface& surface,
                                            const BodyDescription& description,
                                            const std::function<bool()>& is_wanted);

    std::span<const BodyPiece> pieces() const { return pieces_; }
    // A finite point of the template frame; piece: of the surface.
    BodyPoint find(const Eigen::Vector3d& point, uint8_t piece) const;
    // How many of a template's vertices it is made of.
    size_t vertices() const { return vertices_; }

  private:
    std::vector<BodyPiece> pieces_;
    std::vector<double> steps_;  // mm between handles, per piece
    size_t vertices_ = 0;
};

}  // namespace defrec
