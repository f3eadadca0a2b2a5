// How an elastic half-space, or a layer bonded to a rigid base, answers to surface loads that are
// waves. Exact linear elasticity, for one wave number at a time.
//
// z points into the tissue and is 0 at the surface; the shear modulus is 1/2. Papkovich-Neuber
// potentials in plane strain, as in Barber, Elasticity, chapters 21 and 25.
#pragma once

#include <Eigen/Core>

namespace defrec::cli {

struct Layer {
    double poisson = 0.45;  ///< below 0.5
    double thickness = 0;   ///< mm, down to the base; 0: a half-space
};

/// Amplitudes at one depth. `along` is in the direction of the wave, `down` into the tissue.
struct WaveAmplitudes {
    double along = 0, down = 0;
};

class WaveResponse {
  public:
    /// wave_number: 1/mm, above 0.
    WaveResponse(const Layer& layer, double wave_number);

    /// A pressure cos(kx) into the tissue moves it down by `down` cos(kx), along by `along`
    /// sin(kx).
    WaveAmplitudes to_pressure(double z) const { return amplitudes(pressed_, z); }
    /// A traction sin(kx) along x moves it along by `along` sin(kx), down by `down` cos(kx).
    WaveAmplitudes to_traction(double z) const { return amplitudes(dragged_, z); }
    /// A traction cos(kx) along y moves it along y by this times cos(kx).
    double to_traction_across(double z) const;

  private:
    WaveAmplitudes amplitudes(const Eigen::Vector4d& potentials, double z) const;

    Layer layer_;
    double k_;
    Eigen::Vector4d pressed_, dragged_;  ///< factors of the potentials for each load
};

}  // namespace defrec::cli
