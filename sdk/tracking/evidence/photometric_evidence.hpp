// The left image's evidence of where along the surface a vertex is: whether the tissue that the
// template has there is what is seen there, and how far patches lie from where they were found.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/tracking/frame/frame_output.hpp"

namespace defrec {

// mm of depth at z for a px of disparity.
template <class Depth>  // a number, or an array of Eigen's
Depth depth_per_px(const defrec_camera& camera, const Depth& z) {
    return z * z / (static_cast<float>(camera.fx) * static_cast<float>(camera.baseline_mm));
}

// Whether live depth lies farther from the surface than disparity errs in poor images.
bool lies_elsewhere(const defrec_camera& camera, const defrec_surface_sample& sample);

// 1 / (0.1 px)^2: how well a check's place is known in its worst direction; 0 where it was not
// located.
float least_information(const defrec_patch_observation& found);

// Which vertices lie in the windows of a template's checks, worked out once.
struct CheckedVertices {
    explicit CheckedVertices(const TemplateData& data);

    // Per check:
    std::vector<int32_t> nearest;  // vertex in its window, to its middle; -1: none
    std::vector<uint32_t> count;   // vertices in its window
};

// Per vertex.
struct PhotometricEvidence {
    // The live image shows there what the template shows, and does so at most checks round it.
    std::vector<uint8_t> is_confirmed;
    // Likewise, by checks that were found, not only compared where they are predicted: what the
    // tissue does that is noticed where checks are not found.
    std::vector<uint8_t> is_located;
    std::vector<float> check_px2;    // squared distance at which it fits best; where confirmed
    std::vector<float> check_score;  // ZNCC there, 0..1; where confirmed
    std::vector<float> patch_px2;  // mean squared distance of the patches round it from where they
                                   // were found
    // Share of the checks round it that are refuted, beyond what occurs in any frame: live depth
    // agrees there, or lies behind, and the image shows something else; or they are found where
    // depth is another. 0 where it is confirmed.
    std::vector<float> refuted;
    uint32_t vertices_refuted = 0;  // in the windows of such checks
    // Working memory, per control point, sums weighted as it moves what they are of.
    std::vector<Eigen::Array2f> patches;  // px^2 of them, and their weights
    std::vector<Eigen::Array4f> checks;   // located, fitting, refuted, all
    std::vector<Eigen::Array2f> regions;  // located ones and all, over a control point's region
    std::vector<Eigen::Array2d> area;     // likewise, of all above and to the left in the grid
    // Per check: it was found, or fits; its region may ask for more.
    std::vector<uint8_t> is_check_located, does_check_fit;

    void make_room(const TemplateData& data);
};
// Sums of their own, so that both may run at once; patch_px2: of measure_patches. Throw
// nothing once there is room.
void spread_patches(const TemplateData& data, std::span<const double> patch_px2,
                    PhotometricEvidence& evidence);
void spread_checks(const TemplateData& data, const CheckedVertices& vertices,
                   const FrameOutput& output, PhotometricEvidence& evidence);
// All else of the vertices begin to end, from the sums.
void measure_photometric(const TemplateData& data, const FrameOutput& output, size_t begin,
                         size_t end, PhotometricEvidence& evidence);

}  // namespace defrec
