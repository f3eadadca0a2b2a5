// A piece of a template's surface, and where its tissue is that is not seen: universal kriging
// (Cressie, Statistics for Spatial Data, 1993, 3.4), whose trend is a rigid motion and whose
// covariance is learnt.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdk/template/template.hpp"
#include "sdk/tracking/evidence/vertex_confidence.hpp"
#include "sdk/tracking/points/unseen_cells.hpp"
#include "sdk/tracking/points/unseen_kriging.hpp"
#include "sdk/tracking/points/unseen_modes.hpp"

namespace defrec {

class UnseenPiece {
  public:
    UnseenPiece(const Template& surface, size_t piece);
    // The piece before the template grew or was cut: what was learnt of it stays.
    void learn_from(const UnseenPiece& before);

    // Reads a frame.
    void read(SurfaceSamples samples, const VertexConfidence& confidence);
    // One of the two follows. Some control points move nothing that is seen: true: place() tells
    // where tissue is, and variance_mm2() after find_variances() how well.
    bool solve_frame();
    // cells: those of whose vertices variance_mm2() is asked for.
    void find_variances(const CellSet& cells);
    // The cell of a vertex of this piece.
    size_t cell_of(size_t vertex) const { return cells_.cell_of(vertex); }
    // All move something that is seen; may follow solve_frame(), which then teaches nothing.
    void skip_frame();
    // Learns from that frame, where it has something to teach.
    bool has_lesson() const { return lesson_ != Lesson::kNone; }
    void learn();
    // The piece, or all of the surface, is lost in a frame.
    void add_lost_frame() {
        cells_.add_lost_frame();
        lesson_ = Lesson::kNone;
        is_reusable_ = false;
    }
    // After solve_frame() has said true: where a place of the template frame is in that frame, with
    // the modes' shapes there.
    Eigen::Vector3d place(const Eigen::Vector3d& at_rest,
                          const Eigen::Ref<const Eigen::VectorXd>& shapes) const;
    // A row for each place.
    Eigen::MatrixXd shapes(const Eigen::Matrix3Xd& places) const { return modes_.shapes(places); }
    // Width of the first view at the piece's median depth, mm.
    double view_width_mm() const { return cells_.view_width_mm(); }
    Eigen::Matrix3d rotation() const { return pose_.linear(); }
    // Variance of the error of such a place, mm^2, at a vertex of this piece.
    double variance_mm2(size_t vertex) const { return variance_[cells_.cell_of(vertex)]; }

  private:
    // As a span, of which expressions make no copies.
    std::span<const uint32_t> cells_seen() const { return cells_.seen().cells; }
    void find_shapes_seen();
    Eigen::Matrix3Xd displacements() const;
    Eigen::VectorXd weights() const;
    void weigh(const Eigen::VectorXd& weight);
    double raise_noise();
    void fit_pose();
    // Finds the pose and the coefficients with the weights; false: the numbers do not do.
    bool estimate();
    // The same with this frame's weights.
    bool solve();
    std::optional<double> solve_with_noise_before();
    // The same with those of the frame before; false: they do not fit this one.
    bool solve_as_before();
    bool change_weights();
    void find();
    void find_base_variances(const CellSet& cells);
    double unseen_mm2(Eigen::Index cell) const;
    void learn_directly();

    UnseenCells cells_;
    DisplacementModes modes_;
    std::optional<LearntCoefficients> learnt_;  // none: there are no cells
    uint32_t all_frames_ = 0;

    // This frame's.
    // Left for learn() to do.
    enum class Lesson : uint8_t { kNone, kDirect, kSolve, kSolved, kSolvedAsBefore };
    Lesson lesson_ = Lesson::kNone;
    bool is_telling_ = false;               // what is observed tells how the surface moves
    std::optional<UnseenKriging> kriging_;  // its places are the cells
    Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
    DisplacementModel whole_cells_;  // about that centre, whatever is seen of them
    Eigen::VectorXd raise_;          // per cell: factor on its noise, for it stood out
    // Per cell: variance of its displacement, before weights changed; NaN: not asked for yet.
    Eigen::VectorXd base_mm2_;
    CellSet asked_;
    Eigen::MatrixXd shapes_seen_;
    // Per cell: where it was last seen at rest, and a row of the shapes there. Most cells are seen
    // at the same place in many frames.
    Eigen::Matrix3Xd shaped_rest_;
    Eigen::MatrixXd shapes_of_cells_;
    Eigen::MatrixXd shift_;       // of shapes: from where cells were weighed to where they are
    bool is_reusable_ = false;    // the next frame may go by these weights
    Eigen::Matrix3Xd displaced_;  // a column for each cell
    UnseenKriging::Found found_;  // of these
    Eigen::MatrixX3d coefficients_;
    Eigen::Isometry3d pose_ = Eigen::Isometry3d::Identity();
    std::vector<double> variance_;  // per cell
};

}  // namespace defrec
