// An elastic half-space, or a layer bonded to a rigid base, under Gaussian loads of its surface:
// the exact linear solution, by Hankel transforms of the responses to waves.
#pragma once

#include <vector>

#include "sdk/scenes/bodies/elastic_body.hpp"
#include "sdk/scenes/bodies/wave_response.hpp"

namespace defrec::cli {

/// Displacement at a distance r from the middle of a load, in cylindrical parts.
struct RadialParts {
    // A pressure: down, and outwards from its middle.
    double press_down = 0, press_out = 0;
    // A traction along x at the angle a: x = even - twice cos 2a, y = -twice sin 2a, down = -once
    // cos a.
    double drag_even = 0, drag_once = 0, drag_twice = 0;
};

/// The integrals themselves, for loads exp(-r^2 / (2 width^2)) of unit height.
class GaussianLoad {
  public:
    /// width: mm.
    GaussianLoad(const Layer& layer, double width);
    RadialParts at(double r, double z) const;  ///< mm

    struct Wave {
        double k, weight;
        WaveResponse response;
    };
    const std::vector<Wave>& waves() const { return waves_; }

  private:
    std::vector<Wave> waves_;
};

/// The same in a table over r for each layer of kBodyDepths that lies above the base, scaled so
/// that each load displaces its middle by 1 mm.
class LoadedLayer : public ElasticBody {
  public:
    LoadedLayer(const Layer& layer, double width);
    Eigen::Vector3d displacement(const BodyLoad& load, double s, double t,
                                 std::size_t layer) const override;

  private:
    RadialParts interpolated(double r, std::size_t layer) const;

    std::vector<std::vector<RadialParts>> table_;  ///< layer, r
};

}  // namespace defrec::cli
