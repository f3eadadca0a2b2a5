// From what a view sees to its 8-bit picture: light, highlights, instrument, smoke, lens blur and
// sensor.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "sdk/scenes/blood.hpp"
#include "sdk/scenes/instrument.hpp"
#include "sdk/scenes/mesh_raster.hpp"
#include "sdk/scenes/tissue.hpp"

namespace defrec::cli {

/// A veil between lens and tissue.
struct Smoke {
    float density = 0;          ///< 0..1: the veil's share of the picture where it is thickest
    double time = 0;            ///< frames; it drifts and curls
    float thickness = 1;        ///< how much of it is near its density
    std::uint32_t pattern = 0;  ///< another number, another cloud
};

/// A lens that is not sharp everywhere.
struct Focus {
    double distance = 80;  ///< mm, at which it is sharp
    double aperture = 0;   ///< mm, the lens's diameter; 0: sharp everywhere
};

/// What stands before the lens when the camera is out of the body.
enum class Outside { none, dark, drape };

struct Lighting {
    Eigen::Vector3d lamp = Eigen::Vector3d::Zero();  ///< in the view's frame, mm
    double distance = 80;                            ///< mm, at which exposure holds
    float exposure = 1;
};

/// A wet film that shines in broad lobes under lamps of its own.
struct Sheen {
    std::vector<Eigen::Vector3d> lamps;  ///< in the view's frame, mm
    float strength = 0;
    float exponent = 80;  ///< of the cosine between normal and half vector
    float moved = 0;      ///< mm by which its ripples have moved over the tissue
    std::uint32_t seed = 0;
};

struct Sensor {
    Rgb gain{1, 1, 1};
    float offset = 0;        ///< grey levels
    float gamma = 1;         ///< exponent of the grey levels' share of 255
    float noise = 1;         ///< 1: standard deviation 1.2 to 2 grey levels
    std::uint64_t seed = 0;  ///< of this view and frame
};

struct PictureRequest {
    Lighting lighting;
    Sheen sheen;
    std::vector<Instrument> instruments;  ///< scene's frame
    std::optional<Blood> blood;
    Smoke smoke;
    Focus focus;
    Outside outside = Outside::none;
    Eigen::Vector3d view_offset =
        Eigen::Vector3d::Zero();  ///< mm, from the left view; for smoke and drape
};

/// Paints the pictures of one size; holds the buffers between frames.
class Painter {
  public:
    explicit Painter(int threads) : threads_(threads) {}

    /// What the next of the meshes that hits name looks like; must outlive the painter.
    void add_look(const Tissue& tissue) { looks_.push_back(&tissue); }

    // A picture is one exposure or more, each a share of 1, and their development. Same bits for
    // any number of threads.
    void expose(const View& view, const std::vector<Hit>& hits, const PictureRequest& request,
                float share);
    /// bgr: width * height * 3, written whole.
    void develop(const View& view, const Sensor& sensor, std::vector<std::uint8_t>& bgr);

  private:
    void paint_rows(const View& view, const std::vector<Hit>& hits, const PictureRequest& request,
                    int first, int last);
    Rgb tissue_colour(const View& view, const Hit& hit, const Eigen::Vector2f& ray,
                      const PictureRequest& request,
                      const std::vector<Instrument>& instruments) const;
    void defocus_rows(const View& view, const std::vector<Hit>& hits, const Focus& focus, int first,
                      int last);
    void develop_rows(const View& view, const Sensor& sensor, int first, int last,
                      std::vector<std::uint8_t>& bgr) const;
    void prepare_smoke(const View& view, const PictureRequest& request);
    float smoke_at(int u, int v) const;

    std::vector<const Tissue*> looks_;  ///< of the meshes
    int threads_;
    std::vector<Rgb> light_;    ///< linear, of one exposure, before the lens blurs it
    std::vector<Rgb> sharp_;    ///< light_ before the lens is out of focus
    std::vector<Rgb> exposed_;  ///< the sum of the exposures; empty after development
    std::vector<float> veil_;
    int veil_columns_ = 0;
};

}  // namespace defrec::cli
