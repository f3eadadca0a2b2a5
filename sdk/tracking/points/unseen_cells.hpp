// A piece of a template's surface, parted into cells of about an eighth of the view. In each frame
// the vertices of a cell that are observed are averaged.
#pragma once
#include <Eigen/Core>
#include <bitset>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/template/template.hpp"
#include "sdk/tracking/decisions/unseen.hpp"
#include "sdk/tracking/evidence/vertex_confidence.hpp"

namespace defrec {

using CellSet = std::bitset<decisions::UnseenCells::kMaxCells>;

class UnseenCells {
  public:
    UnseenCells(const Template& surface, size_t piece);
    // The cells before the template grew or was cut.
    void take_ages(const UnseenCells& before);

    // Cells of which enough is observed: means of their observed vertices.
    struct Seen {
        Eigen::Matrix3Xd rest, now;  // mm, in the template frame and in this one
        Eigen::VectorXd error_mm2;   // squared expected error
        std::vector<uint32_t> cells;
    };
    // Reads a frame; false: what is observed does not tell how the surface moves.
    bool read(SurfaceSamples samples, const VertexConfidence& confidence);
    // After read(): of that frame.
    const Seen& seen() const { return seen_; }
    // The piece is lost in a frame.
    void add_lost_frame();

    size_t size() const { return age_.size(); }
    // Means of the cells' vertices in the template frame, mm.
    const Eigen::Matrix3Xd& rest() const { return rest_; }
    // Frames since enough of a cell was observed.
    uint32_t age(Eigen::Index cell) const { return age_[static_cast<size_t>(cell)]; }
    // The cell of a vertex of this piece.
    size_t cell_of(size_t vertex) const { return static_cast<size_t>(cell_of_[vertex]); }
    // Width of the first view at the piece's median depth, mm.
    double view_width_mm() const { return view_width_mm_; }
    // Least distance between the centres that cells were made of, mm.
    double apart_mm() const { return apart_mm_; }

  private:
    // A vertex that is read.
    struct Sample {
        uint32_t vertex;
        int32_t cell;
        Eigen::Vector3f rest;
    };
    using Centres = std::vector<Eigen::Vector3d>;
    Centres spread_centres(const TemplateData& data, std::span<const uint32_t> vertices);
    // Gives vertices to their nearest centres. Returns how many each gets.
    std::vector<uint32_t> assign(const TemplateData& data, std::span<const uint32_t> vertices,
                                 const Centres& centres);
    void choose_samples(const TemplateData& data, std::span<const uint32_t> vertices);

    double view_width_mm_;
    double apart_mm_;
    std::vector<int32_t> cell_of_;  // per vertex; -1: of another piece
    std::vector<Sample> samples_;
    uint32_t least_seen_ = 1;  // samples of a cell
    Eigen::Matrix3Xd rest_;
    std::vector<uint32_t> age_;  // per cell

    // This frame's, per cell.
    std::vector<uint32_t> count_;
    Eigen::Matrix3Xd sum_rest_, sum_now_;
    Eigen::VectorXd sum_error_mm2_;
    Seen seen_;
};

}  // namespace defrec
