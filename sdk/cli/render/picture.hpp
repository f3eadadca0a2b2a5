// From what a view sees to its 8-bit picture: light, highlights, instrument, smoke, lens blur and
// sensor.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "sdk/cli/render/instrument.hpp"
#include "sdk/cli/render/mesh_raster.hpp"
#include "sdk/cli/render/tissue.hpp"

namespace defrec::cli {

/// A veil between lens and tissue.
struct Smoke {
    float density = 0;  ///< 0..1: the veil's share of the picture where it is thickest
    double time = 0;    ///< frames; it drifts and curls
};

/// What stands before the lens when the camera is out of the body.
enum class Outside { none, dark, drape };

struct Lighting {
    Eigen::Vector3d lamp = Eigen::Vector3d::Zero();  ///< in the view's frame, mm
    double distance = 80;                            ///< mm, at which exposure holds
    float exposure = 1;
};

struct Sensor {
    Rgb gain{1, 1, 1};
    float offset = 0;        ///< grey levels
    float noise = 1;         ///< 1: standard deviation 1.2 to 2 grey levels
    std::uint64_t seed = 0;  ///< of this view and frame
};

struct PictureRequest {
    Lighting lighting;
    Sensor sensor;
    std::vector<Instrument> instruments;  ///< scene's frame
    Smoke smoke;
    Outside outside = Outside::none;
    Eigen::Vector3d view_offset =
        Eigen::Vector3d::Zero();  ///< mm, from the left view; for smoke and drape
};

/// Paints the pictures of one size; holds the buffers between frames.
class Painter {
  public:
    Painter(const Tissue& tissue, int threads) : tissue_(tissue), threads_(threads) {}

    /// bgr: width * height * 3, written whole. Same bits for any number of threads.
    void paint(const View& view, const std::vector<Hit>& hits, const PictureRequest& request,
               std::vector<std::uint8_t>& bgr);

  private:
    void paint_rows(const View& view, const std::vector<Hit>& hits, const PictureRequest& request,
                    int first, int last);
    Rgb tissue_colour(const View& view, const Hit& hit, const Eigen::Vector2f& ray,
                      const PictureRequest& request,
                      const std::vector<Instrument>& instruments) const;
    void expose_rows(const View& view, const PictureRequest& request, int first, int last,
                     std::vector<std::uint8_t>& bgr) const;
    void prepare_smoke(const View& view, const PictureRequest& request);
    float smoke_at(int u, int v) const;

    const Tissue& tissue_;
    int threads_;
    std::vector<Rgb> light_;  ///< linear, before the lens blurs it
    std::vector<float> veil_;
    int veil_columns_ = 0;
};

}  // namespace defrec::cli
