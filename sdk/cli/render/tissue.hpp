// What the tissue looks like at a material point: albedo, roughness of the wet film and vessels. Defined by formulas
// on material coordinates, so that it sticks to the tissue and does not pixelate when the camera comes near.
#pragma once

#include <cstdint>
#include <vector>

namespace defrec::cli {

struct Rgb {
    float r = 0, g = 0, b = 0;

    friend Rgb operator+(Rgb x, Rgb y) { return {x.r + y.r, x.g + y.g, x.b + y.b}; }
    friend Rgb operator*(Rgb x, Rgb y) { return {x.r * y.r, x.g * y.g, x.b * y.b}; }
    friend Rgb operator*(float k, Rgb x) { return {k * x.r, k * x.g, k * x.b}; }
};

inline Rgb mix(Rgb x, Rgb y, float share) { return (1.0f - share) * x + share * y; }

/// Shares of 1, where 1 is a well textured organ.
struct TissueLook {
    float mottling = 1.0f;  ///< contrast of the multi-octave noise
    float vessels = 1.0f;   ///< contrast of vessels and capillaries
    float spots = 1.0f;     ///< contrast of small pits and blood spots
    float gloss = 1.0f;     ///< strength of highlights
    Rgb base{0.56f, 0.175f, 0.125f};  ///< linear reflectance
};

class Tissue {
  public:
    struct Sample {
        Rgb albedo;         ///< linear reflectance
        float slope_s = 0;  ///< of the wet film, for highlights
        float slope_t = 0;
        float wetness = 0;  ///< 0..1
    };

    /// The vessel network covers |s| <= half_width, |t| <= half_height, mm.
    Tissue(const TissueLook& look, float half_width, float half_height, std::uint64_t seed);

    /// footprint: mm of tissue under one pixel; details smaller than about two pixels fade out. Any thread.
    Sample at(float s, float t, float footprint) const;

  private:
    struct Segment {
        float s0, t0, s1, t1, r0, r1;
        bool vein;
    };
    struct Branch {
        float s, t, heading, radius;
        bool vein;
    };

    void grow_vessels(std::uint64_t seed);
    void index_segments();
    Rgb mottled(float s, float t, float footprint) const;
    Rgb with_vessels(Rgb albedo, float s, float t, float footprint) const;
    Rgb with_capillaries(Rgb albedo, float s, float t, float footprint) const;
    Rgb with_spots(Rgb albedo, float s, float t, float footprint) const;

    TissueLook look_;
    float half_width_, half_height_;
    std::uint32_t seed_;
    std::vector<Segment> segments_;
    int cells_s_ = 0, cells_t_ = 0;
    std::vector<std::int32_t> cell_start_;  ///< cells_s_ * cells_t_ + 1
    std::vector<std::int32_t> cell_items_;
};

}  // namespace defrec::cli
