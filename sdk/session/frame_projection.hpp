// From the rectified camera's millimetres to pixels of the left image as given, and back to surface
// points.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "sdk/client/library.hpp"

namespace defrec::cli {

// Borrows the rig. One thread at a time.
class RawProjection {
  public:
    explicit RawProjection(const Rig& rig);

    // xyz, uv interleaved. NaN for points at or behind the camera or not finite.
    void project(const float* xyz, std::size_t count, float* uv);
    void project(const double* xyz, std::size_t count, double* uv);
    // To pixels of the rectified left image.
    void project_rectified(const double* xyz, std::size_t count, double* uv) const;
    // Pixels of the rectified left image to those of the image as given; NaN stays NaN.
    void distort(double* uv, std::size_t count) const;

  private:
    const Rig& rig_;
    defrec_camera camera_;
    std::vector<double> scratch_;
};

}  // namespace defrec::cli
