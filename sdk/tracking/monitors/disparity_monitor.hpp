// Watches whether disparities change as the left image does. Tissue that comes nearer grows in the
// image, and keeps its size in mm; a right view that slips sideways in its mount changes
// disparities alone, and with them all lengths. After a jump of the picture, to other tissue or
// another time, the frames before it are no measure; but where the picture rests before and after a
// jump that is a change of scale alone, both views were zoomed: nothing moves like that.
#pragma once
#include <array>
#include <complex>
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
    // The next frame is of another time: what was measured up to now is no measure for it.
    void begin_anew() {
        places_.clear();
        usual_.reset();
    }
    // Begins with another template. A zoom stays.
    void reset();

    // px by which disparities are off since the template was taken, or the views were zoomed; 0: by
    // none that shows.
    double baseline_drift_px() const;

    // From one frame to another, or per frame.
    struct Change {
        // Logarithms of how much more disparities grew than the left image did, and than lengths on
        // the surface shrank.
        double by_scale = 0, by_length = 0;
        // The left image's best similarity: logarithm of its scale, with the turn as imaginary
        // part; and shift of its middle, over the focal length.
        std::complex<double> growth, shift;
        // Shift of the principal point by that similarity, over the focal length.
        std::complex<double> aside;
    };
    // A vertex and another one near it; NaN where it is not observed.
    using Places = std::array<std::array<float, 3>, 2>;

  private:
    void judge(const TemplateData& data, const Change& change, double radius);
    void confirm(const TemplateData& data);
    void settle(const Change& change);
    void change_zoom(double by);

    std::vector<Places> places_, places_now_;  // in the last frame in which many were observed
    int age_ = 0;                              // frames since then
    std::optional<Change> usual_;              // per frame, in the last one
    int settling_ = 0;                         // frames left that a jump spoils
    double drift_ = 0;                         // logarithm of the factor on disparities
    double zoom_ = 0;                          // logarithm of the factor on both images
    double new_zoom_ = 0;        // the last part of it, which the next frame confirms; 0: none
    double growth_before_ = 0;   // of the left image, before that
    double mean_disparity_ = 0;  // px
    int unconfirmed_ = 0;        // frames that did not confirm the drift, less those that did
};

}  // namespace defrec
