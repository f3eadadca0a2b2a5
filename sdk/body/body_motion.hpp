// Where a body is in one frame.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "sdk/body/body.hpp"

namespace defrec {

class Services;

// The surface in a frame, per vertex; the vertices are at least those that the body is made of.
struct SurfaceNow {
    std::span<const float> positions;       // xyz, mm
    std::span<const float> expected_error;  // mm, root mean square
};

// An application's knowledge of what lies deep, rectified camera from template frame.
struct DeepKnowledge {
    std::optional<Eigen::Isometry3d> held;      // its motion
    std::optional<Eigen::Isometry3d> expected;  // its motion if it stood still before the camera
};

// How much a vertex with that expected error says, 0..1.
double evidence_of(double error_mm);

class BodyMotion {
  public:
    // The motions that nobody knows are estimated. helpers: whose threads take part; may be null.
    BodyMotion(std::shared_ptr<const Body> body, const SurfaceNow& surface,
               const DeepKnowledge& known, const Services* helpers);

    struct Moved {
        Eigen::Vector3d place = Eigen::Vector3d::Zero();
        // The expected error is made of these; docs/api/beneath.md says how.
        double surface_mm2 = 0;      // mean squared error of the surface that it depends on
        double deformation_mm2 = 0;  // of that surface, mean square about its own mean
        double shift_mm2 = 0;        // of that surface's mean against what lies deep
        double choice_mm2 = 0;       // by which choices of the deep motion differ there
        double evidence = 0;         // 0..1, of that surface
        double activity_mm2 = 0;  // mean square of what is seen of the piece against what lies deep
    };
    Moved move(const BodyPoint& point, const Eigen::Vector3d& at_rest) const;

    const Body& body() const { return *body_; }
    // The motion of what lies deep beneath a piece.
    const Eigen::Isometry3d& deep_motion(size_t piece) const { return pieces_[piece].deep; }

  private:
    // A node's place (three), and what Moved has (five).
    using NodeNow = Eigen::Matrix<float, 8, 1>;
    struct Piece {
        Eigen::Isometry3d deep;
        double activity_mm2 = 0;
        std::vector<NodeNow> nodes;
        Eigen::Matrix3Xf left;  // of the handles: what the body does not follow, mm
    };
    static Piece move_piece(const BodyPiece& piece, const SurfaceNow& surface,
                            const DeepKnowledge& known, const Services* helpers);

    std::shared_ptr<const Body> body_;
    std::vector<Piece> pieces_;
};

}  // namespace defrec
