// Watches whether disparities change as the left image does. Tissue that comes nearer grows in the
// image, and keeps its size in mm; a right view that slips sideways in its mount changes
// disparities alone, and with them all lengths.
#pragma once
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "sdk/template/template.hpp"

namespace defrec {

class DisparityMonitor {
  public:
    // Once there is room, add_frame() throws nothing.
    void make_room();
    // A frame that was followed with depth, in the order of the frames.
    void add_frame(const TemplateData& data, std::span<const defrec_surface_sample> samples);
    // A frame that says nothing of disparities.
    void skip_frame() { ++age_; }
    // The vertices are others from the next frame on.
    void forget_vertices() { places_.clear(); }
    void reset() { *this = {}; }

    // px by which disparities are off since the template was taken; 0: by none that shows.
    double baseline_drift_px() const;

    // Logarithms of how much more disparities grew than the left image did, and than lengths on the
    // surface shrank.
    struct Change {
        double by_scale = 0, by_length = 0;
    };
    // A vertex and another one near it; NaN where it is not observed.
    using Places = std::array<std::array<float, 3>, 2>;

  private:
    void judge(const Change& change);

    std::vector<Places> places_, places_now_;  // in the last frame in which many were observed
    int age_ = 0;                              // frames since then
    std::optional<Change> usual_;              // change per frame
    double drift_ = 0;                         // logarithm of the factor on disparities
    double mean_disparity_ = 0;                // px
    int frames_that_fit_ = 0;                  // the template without a slip, one after the other
};

}  // namespace defrec
