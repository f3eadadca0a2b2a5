// The colour that the tissue of each vertex has, learnt while the left image shows it, and whether
// the image has a colour there that the tissue has nowhere: something lies on it, or is in front.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "sdk/rig/rig.hpp"
#include "sdk/tracking/frame/colour_cells.hpp"

namespace defrec {

class TissueColours {
  public:
    explicit TissueColours(std::shared_ptr<const Rig> rig) : rig_(std::move(rig)) {}

    // Another template is tracked.
    void forget();
    // Takes the cells of the next frame's raw left image, and leaves others' memory.
    void take(ColourCells& cells) { std::swap(cells_, cells); }

    // Nothing is told of frames without colour, nor before any was learnt. Until take() by any
    // thread.
    bool any() const { return cells_.any() && is_learnt_; }
    bool is_covered(size_t vertex, const defrec_surface_sample& sample) const;

    // Learns from the frame, in which the left image shows the vertices with shown != 0.
    void learn(std::span<const defrec_surface_sample> samples, std::span<const uint8_t> shown);

  private:
    Chromaticity colour_at(const defrec_surface_sample& sample) const;
    void learn_spread();

    std::shared_ptr<const Rig> rig_;
    ColourCells cells_;
    std::vector<Chromaticity> own_;  // per vertex
    bool is_learnt_ = false;
    uint32_t frames_ = 0;                        // learnt from
    Chromaticity shift_ = Chromaticity::Zero();  // of all, by light and camera
    Chromaticity mean_ = Chromaticity::Zero();   // of own_
    Eigen::Matrix2f inverse_;                    // of its covariance
    std::vector<float> shifts_[2];               // working memory
};

}  // namespace defrec
