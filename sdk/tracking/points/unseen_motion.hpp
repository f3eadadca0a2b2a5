// Places tissue that is not seen: it has left the image, or something is in front of it. How the
// parts of a surface move together is learnt while they are seen; what is seen then tells where the
// rest is: universal kriging (Cressie, Statistics
// for Spatial Data, 1993, 3.4), whose trend is a rigid motion and whose covariance is learnt by
// expectation maximisation (Dempster, Laird and Rubin, 1977).
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdk/base/os/services.hpp"
#include "sdk/base/util/array_part.hpp"
#include "sdk/template/template.hpp"
#include "sdk/tracking/evidence/vertex_confidence.hpp"
#include "sdk/tracking/points/hole_fill.hpp"
#include "sdk/tracking/points/unseen_cells.hpp"
#include "sdk/tracking/points/unseen_kriging.hpp"

namespace defrec {

// A piece of a template's surface.
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
    void find_variances();
    // All move something that is seen.
    void skip_frame();
    // Learns from that frame. Nobody waits for it.
    void learn();
    // The piece is lost in a frame.
    void add_lost_frame() {
        cells_.add_lost_frame();
        lesson_ = Lesson::kNone;
    }
    // After solve_frame() has said true: where a place of the template frame is in that frame, with
    // the modes' shapes there.
    Eigen::Vector3d place(const Eigen::Vector3d& at_rest,
                          const Eigen::Ref<const Eigen::VectorXd>& shapes) const;
    // A row for each place.
    Eigen::MatrixXd shapes(const Eigen::Matrix3Xd& places) const;
    Eigen::Matrix3d rotation() const { return pose_.linear(); }
    // Variance of the error of such a place, mm^2, at a vertex of this piece.
    double variance_mm2(size_t vertex) const { return variance_[cells_.cell_of(vertex)]; }

  private:
    Eigen::Matrix3Xd displacements() const;
    Eigen::VectorXd weights() const;
    void weigh(const Eigen::VectorXd& weight);
    double raise_noise();
    void fit_pose();
    // Finds the pose and the coefficients with the weights; false: the numbers do not do.
    bool estimate();
    // The same with this frame's weights.
    bool solve();
    // The same with those of the frame before; false: they do not fit this one.
    bool solve_as_before();
    bool change_weights();
    void find_base_variances();
    double unseen_mm2(Eigen::Index cell) const;
    void learn(const Eigen::MatrixX3d& coefficients, const Eigen::MatrixXd& covariance);
    void learn_directly();
    const Eigen::MatrixXd& information();  // the inverse of the coefficients' covariance
    Eigen::MatrixXd kernel(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) const;

    UnseenCells cells_;
    double length_mm_;  // over which displacements are alike
    // The modes: the largest principal components of the cells' kernel.
    Eigen::MatrixXd at_cells_;  // a column each
    Eigen::VectorXd spread_;    // their variances, of the kernel's 1
    Eigen::MatrixXd weigher_;   // of the kernel with the cells: gives a place's shapes

    // Learnt: the sum of products of coefficients, and of how many frames.
    Eigen::MatrixXd products_;
    Eigen::MatrixXd information_;  // empty until it is asked for
    double frames_ = 0;
    uint32_t all_frames_ = 0;

    // This frame's.
    // Left for learn() to do.
    enum class Lesson : uint8_t { kNone, kDirect, kSolve, kSolved, kSolvedAsBefore };
    Lesson lesson_ = Lesson::kNone;
    bool is_telling_ = false;               // what is observed tells how the surface moves
    std::optional<UnseenKriging> kriging_;  // its places are the cells
    Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
    Eigen::VectorXd raise_;     // per cell: factor on its noise, for it stood out
    Eigen::VectorXd base_mm2_;  // per cell: variance of its displacement, before weights changed
    Eigen::MatrixXd shapes_seen_;
    Eigen::MatrixXd shift_;     // of shapes: from where cells were weighed to where they are
    bool is_reusable_ = false;  // the next frame may go by these weights
    Eigen::MatrixX3d coefficients_;
    Eigen::Isometry3d pose_ = Eigen::Isometry3d::Identity();
    std::vector<double> variance_;  // per cell
};

// All pieces of the template that is followed.
class UnseenMotion {
  public:
    UnseenMotion() = default;
    explicit UnseenMotion(const Template& surface);
    // before: of the template before it grew or was cut.
    UnseenMotion(const Template& surface, const UnseenMotion& before);

    // A frame's results; those of tissue that is not seen are changed.
    struct Results {
        std::span<defrec_motion> motions;
        std::span<float> vertices, normals;
        VertexConfidence& confidence;
    };
    // A frame in which the surface was found. helpers: whose threads take part, or nullptr. true:
    // results were changed.
    bool add_frame(const Template& surface, SurfaceSamples samples,
                   std::span<const defrec_piece> pieces, const Results& results,
                   const Services* helpers);
    // Learns from the last frame, once nobody waits for it.
    void learn() noexcept;

  private:
    // A control point's vertices, bits.
    enum Moves : uint8_t { kOutside = 1, kHidden = 2, kSeen = 4 };
    void find_moves(const TemplateData& data, SurfaceSamples samples,
                    const VertexConfidence& confidence, ArrayPart part);
    // Nothing that it moves is in the image.
    bool is_outside(size_t node) const { return moves_[node] == kOutside; }
    // Something that it moves is in the image, and nothing of it is seen.
    bool is_hidden(size_t node) const {
        return (moves_[node] & kHidden) != 0 && (moves_[node] & kSeen) == 0;
    }
    void read_pieces(SurfaceSamples samples, std::span<const defrec_piece> pieces,
                     const VertexConfidence& confidence);
    bool solve_pieces(const TemplateData& data, std::span<const defrec_piece> pieces);
    void find_variances();
    void find_detail(const TemplateData& data, std::span<const defrec_motion> motions,
                     const VertexConfidence& confidence);
    Eigen::Vector3d place(const TemplateData& data, size_t node) const;
    void move_nodes(const TemplateData& data, const Results& results, ArrayPart part) const;
    defrec_motion move_hidden(const TemplateData& data, size_t node, const Results& results) const;
    void move_vertices(const Template& surface, const Results& results, ArrayPart part) const;
    struct Shares {
        double outside = 0, hidden = 0;  // of what moves a vertex
    };
    Shares shares_of(const defrec_surface_point& vertex) const;

    std::vector<UnseenPiece> pieces_;
    std::vector<uint32_t> vertex_of_;  // per control point: which it moves most
    Eigen::MatrixXd shapes_;           // a column for each control point, of its piece's modes
    std::vector<uint32_t> hidden_;     // per piece: how many control points are
    std::vector<uint8_t> is_apart_;    // per piece: enough control points move nothing that is seen
    std::vector<uint8_t> moves_;       // per control point
    std::vector<HoleFill::Kind> kinds_;
    HoleFill detail_;  // by which lm moves control points round a hole otherwise than the modes do
};

}  // namespace defrec
