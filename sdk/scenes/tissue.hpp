// What the tissue looks like at a material point: albedo, roughness of the wet film and vessels.
// Defined by formulas on material coordinates, so that it sticks to the tissue and does not
// pixelate when the camera comes near.
#pragma once

#include <cstdint>
#include <vector>

#include "sdk/scenes/noise.hpp"

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
    float mottling = 1.0f;            ///< contrast of the multi-octave noise
    float vessels = 1.0f;             ///< contrast of vessels and capillaries
    float spots = 1.0f;               ///< contrast of small pits and blood spots
    float gloss = 1.0f;               ///< strength of highlights
    float wet_share = 0.0f;           ///< 0: highlights on wet patches only; 1: everywhere
    float film_relief = 1.0f;         ///< of the wet film; less gives fewer, larger highlights
    float detail = 1.0f;              ///< 2: everything is half as large
    Rgb base{0.56f, 0.150f, 0.110f};  ///< linear reflectance
};

class Tissue {
  public:
    struct Sample {
        Rgb albedo;         ///< linear reflectance
        float wetness = 0;  ///< 0..1, of the film that makes highlights
    };
    /// Slopes of the wet film against the surface.
    struct Film {
        float slope_s = 0, slope_t = 0;
    };

    /// Details cover |s| <= half_width / detail, |t| <= half_height / detail, mm; nothing is
    /// defined beyond.
    Tissue(const TissueLook& look, float half_width, float half_height, std::uint64_t seed);

    /// footprint: mm of tissue under one pixel; details smaller than about two pixels fade out. Any
    /// thread.
    Sample at(float s, float t, float footprint) const;
    Film film(float s, float t) const;

  private:
    struct Segment {
        float s0, t0, s1, t1, r0, r1;
        bool vein;
    };
    static constexpr int kGroup = 4;
    using Four = float __attribute__((vector_size(kGroup * sizeof(float))));
    /// Segments of one kind near one cell, field by field; places that are left lie far away.
    struct SegmentGroup {
        Four s0{1e9f, 1e9f, 1e9f, 1e9f}, t0{}, es{}, et{}, r0{}, dr{};
    };
    struct Branch {
        float s, t, heading, radius;
        bool vein;
    };
    /// The octaves of several mm: smooth enough to be tabulated finely and interpolated.
    struct Coarse {
        float wide, patch, mottle, bed, wetness, slope_s, slope_t;
    };

    void grow_vessels(std::uint64_t seed);
    void grow_branch(Branch branch, Random& random, std::vector<Branch>& open);
    void index_segments();
    void tabulate();
    Coarse coarse(float s, float t) const;
    Rgb mottled(float s, float t, float footprint, const Coarse& c) const;
    /// How dark the segments in groups first..last are here, 0..1.
    float darkest_of(std::int32_t first, std::int32_t last, float s, float t,
                     float footprint) const;
    Rgb with_vessels(Rgb albedo, float s, float t, float footprint) const;
    Rgb with_capillaries(Rgb albedo, float s, float t, float footprint, const Coarse& c) const;
    Rgb with_spots(Rgb albedo, float s, float t, float footprint) const;

    TissueLook look_;
    float half_width_, half_height_;
    std::uint32_t seed_;
    std::vector<Segment> segments_;
    int cells_s_ = 0, cells_t_ = 0;
    std::vector<std::int32_t> group_start_;  ///< of each cell's veins and arteries, and the end
    std::vector<SegmentGroup> groups_;
    int table_columns_ = 0, table_rows_ = 0;
    std::vector<Coarse> table_;
};

}  // namespace defrec::cli
