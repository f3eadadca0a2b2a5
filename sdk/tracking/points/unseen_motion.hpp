// Places tissue that is not seen: it has left the image, or something is in front of it. How the
// parts of a surface move together is learnt while they are seen; what is seen then tells where the
// rest is.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "sdk/base/os/services.hpp"
#include "sdk/base/util/array_part.hpp"
#include "sdk/template/template.hpp"
#include "sdk/tracking/evidence/vertex_confidence.hpp"
#include "sdk/tracking/points/hole_fill.hpp"
#include "sdk/tracking/points/unseen_piece.hpp"

namespace defrec {

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
        // Called once before points are moved, which is soon done, where any are.
        std::function<void()> solved;
        // Called for each run of vertices once they are where they stay, by any thread.
        std::function<void(size_t run)> placed;
    };
    // A frame in which the surface was found. helpers: whose threads take part, or nullptr. true:
    // results were changed.
    bool add_frame(const Template& surface, SurfaceSamples samples,
                   std::span<const defrec_piece> pieces, const Results& results,
                   const Services* helpers);
    // A frame in which it was lost.
    void add_lost_frame();
    // Learns from the last frame, once nobody waits for it, where that has something to teach.
    bool has_lesson() const;
    void learn() noexcept;

  private:
    // A control point's vertices, bits.
    enum Moves : uint8_t { kOutside = 1, kHidden = 2, kSeen = 4 };
    void find_moves(const TemplateData& data, SurfaceSamples samples,
                    const VertexConfidence& confidence, ArrayPart part);
    // Hides control points on much of whose vertices something lies: lm drew them to its depth.
    void hide_covered(const TemplateData& data, SurfaceSamples samples,
                      std::span<const uint8_t> covered);
    // Nothing that it moves is in the image.
    bool is_outside(size_t node) const { return moves_[node] == kOutside; }
    bool any_hidden() const;
    // Something that it moves is in the image, and nothing of it is seen.
    bool is_hidden(size_t node) const {
        return (moves_[node] & kHidden) != 0 && (moves_[node] & kSeen) == 0;
    }
    void read_pieces(SurfaceSamples samples, std::span<const defrec_piece> pieces,
                     const VertexConfidence& confidence);
    void choose_pieces(const TemplateData& data, std::span<const defrec_piece> pieces);
    bool solve_pieces(const TemplateData& data, const VertexConfidence& confidence);
    void find_variances(const TemplateData& data);
    void find_holes(const TemplateData& data, const VertexConfidence& confidence);
    void find_detail(const TemplateData& data, std::span<const defrec_motion> motions);
    // Where the modes have a control point, and what lm has beyond that.
    Eigen::Vector3d place(const TemplateData& data, size_t node) const;
    Eigen::Vector3d beyond_modes(const TemplateData& data, size_t node,
                                 std::span<const defrec_motion> motions) const;
    void move_nodes(const TemplateData& data, const Results& results, ArrayPart part) const;
    // lm knows where it is.
    bool is_known(size_t node, const VertexConfidence& confidence) const;
    void find_misfits(const TemplateData& data, const Results& results);
    // The variance of a vertex' place by the modes.
    double variance_mm2(uint8_t piece, size_t vertex) const;
    defrec_motion move_by_both(const TemplateData& data, size_t node, const Results& results) const;
    void move_vertices(const Template& surface, const Results& results, size_t run) const;
    struct Shares {
        double outside = 0, hidden = 0;  // of what moves a vertex
    };
    Shares shares_of(const defrec_surface_point& vertex) const;
    // What is left open of a vertex that was placed: a share of lm's covariance, and mm^2 of its
    // own. squared_step: from where lm had it, mm^2.
    struct Remaining {
        double kept, own;
    };
    Remaining remaining(uint8_t piece, size_t vertex, const Shares& share, double squared_step,
                        const VertexConfidence& confidence) const;

    std::vector<UnseenPiece> pieces_;
    std::vector<uint32_t> vertex_of_;  // per control point: which it moves most
    Eigen::MatrixXd shapes_;           // a column for each control point, of its piece's modes
    std::vector<uint32_t> hidden_;     // per piece: how many control points are
    std::vector<uint8_t> is_parted_;   // per piece: a cut parts it
    // Per piece: variance of the modes besides where a cut parts it, as it was last solved for;
    // else 0.
    std::vector<double> misfit_mm2_;
    std::vector<uint8_t> is_apart_;  // per piece: enough control points move nothing that is seen
    // Per piece: solve_frame() was called, for the frame before had it apart, and what it returned.
    enum class Solved : uint8_t { kNotTried, kNo, kYes };
    std::vector<Solved> solved_;
    std::vector<uint8_t> moves_;        // per control point
    std::vector<float> weights_;        // per control point, of all vertices that it moves
    std::vector<float> covered_;        // of those that are covered
    std::vector<CellSet> cells_moved_;  // per control point: those whose vertices it moves
    std::vector<HoleFill::Kind> kinds_;
    std::vector<CellSet> cells_asked_;  // per piece: of whose vertices variances are read
    HoleFill detail_;  // by which lm moves control points round a hole otherwise than the modes do
};

}  // namespace defrec
