// What the tissue looks like at a material point.
#include "sdk/scenes/tissue.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sdk/scenes/noise.hpp"

namespace defrec::cli {
namespace {

constexpr float kCell = 1.0f;         // mm, of the index of vessel segments
constexpr float kTableStep = 0.25f;   // mm
constexpr float kSegmentStep = 0.7f;  // mm
constexpr float kThinnest = 0.06f;    // mm, radius at which a vessel ends
constexpr float kWidestBlur = 0.30f;  // mm, by which a vessel may be widened for a coarse camera
constexpr std::size_t kMaxSegments = 40000;

/// 1 for details of many pixels, 0 below two pixels.
float resolved(float wavelength, float footprint) {
    return smooth_step(1.6f, 3.2f, wavelength / footprint);
}

float lattice_s(float s, float wavelength) { return s / wavelength + 0.37f; }
float lattice_t(float t, float wavelength) { return t / wavelength + 0.71f; }

float octave(float s, float t, float wavelength, std::uint32_t seed) {
    return gradient_noise(lattice_s(s, wavelength), lattice_t(t, wavelength), seed);
}

/// An octave on rows of a grid: octave() to the bit, but a lattice cell is looked up once for all
/// columns in it.
class OctaveRows {
  public:
    OctaveRows(const std::vector<float>& columns, float wavelength, std::uint32_t seed)
        : wavelength_(wavelength), seed_(seed), row_(columns.size()) {
        for (const float s : columns) {
            const float x = lattice_s(s, wavelength);
            const std::int32_t cell = floor_to_int(x);
            if (runs_.empty() || runs_.back().cell != cell) {
                runs_.push_back({cell, offset_.size(), offset_.size()});
            }
            offset_.push_back(x - static_cast<float>(cell));
            fade_.push_back(faded(offset_.back()));
            ++runs_.back().end;
        }
    }

    const float* at(float t) {
        const float y = lattice_t(t, wavelength_);
        const std::int32_t row = floor_to_int(y);
        const float fy = y - static_cast<float>(row);
        const float v = faded(fy);
        for (const Run& run : runs_) {
            const LatticeCell cell(run.cell, row, seed_);
            for (std::size_t i = run.first; i < run.end; ++i) {
                row_[i] = cell.noise(offset_[i], fy, fade_[i], v);
            }
        }
        return row_.data();
    }

  private:
    /// Columns in one lattice cell.
    struct Run {
        std::int32_t cell;
        std::size_t first, end;
    };
    float wavelength_;
    std::uint32_t seed_;
    std::vector<Run> runs_;
    std::vector<float> offset_, fade_;  ///< within the lattice cell
    std::vector<float> row_;
};

}  // namespace

Tissue::Tissue(const TissueLook& look, float half_width, float half_height, std::uint64_t seed)
    : look_(look),
      half_width_(half_width),
      half_height_(half_height),
      seed_(static_cast<std::uint32_t>(scramble(seed ^ 0x71550E))) {
    grow_vessels(seed);
    index_segments();
    tabulate();
}

void Tissue::grow_vessels(std::uint64_t seed) {
    Random random(seed ^ 0xB100D);
    std::vector<Branch> open;
    const int roots = static_cast<int>(4.0f * half_width_ * half_height_ / 1500.0f) + 2;
    for (int i = 0; i < roots; ++i) {
        const bool vein = random.uniform(0, 1) < 0.55;
        Branch root{static_cast<float>(random.uniform(-half_width_, half_width_)),
                    static_cast<float>(random.uniform(-half_height_, half_height_)),
                    static_cast<float>(random.uniform(0, 2.0 * std::numbers::pi)),
                    static_cast<float>(random.uniform(0.25, vein ? 0.95 : 0.6)), vein};
        // Both ways from the thickest place, so that no vessel begins bluntly.
        open.push_back(root);
        root.heading += static_cast<float>(std::numbers::pi);
        open.push_back(root);
    }
    while (!open.empty() && segments_.size() < kMaxSegments) {
        const Branch branch = open.back();
        open.pop_back();
        grow_branch(branch, random, open);
    }
}

void Tissue::grow_branch(Branch b, Random& random, std::vector<Branch>& open) {
    double turning = 0;
    while (b.radius > kThinnest && std::abs(b.s) < half_width_ && std::abs(b.t) < half_height_) {
        turning = 0.74 * turning + random.uniform(-0.12, 0.12);
        b.heading += static_cast<float>(turning + random.uniform(-0.12, 0.12));
        const float s = b.s + kSegmentStep * std::cos(b.heading);
        const float t = b.t + kSegmentStep * std::sin(b.heading);
        const float radius = b.radius * static_cast<float>(random.uniform(0.974, 0.998));
        segments_.push_back({b.s, b.t, s, t, b.radius, radius, b.vein});
        b.s = s;
        b.t = t;
        b.radius = radius;
        if (random.uniform(0, 1) < 0.065) {
            const double side = random.uniform(0, 1) < 0.5 ? -1.0 : 1.0;
            const double share = random.uniform(0.4, 0.85);
            Branch child = b;
            child.radius = b.radius * static_cast<float>(share);
            child.heading += static_cast<float>(side * random.uniform(0.45, 1.2));
            open.push_back(child);
            b.radius *= static_cast<float>(std::sqrt(1.0 - 0.35 * share * share));
        }
    }
}

void Tissue::index_segments() {
    cells_s_ = static_cast<int>(std::ceil(2.0f * half_width_ / kCell)) + 1;
    cells_t_ = static_cast<int>(std::ceil(2.0f * half_height_ / kCell)) + 1;
    const auto cell = [](float x, float half, int cells) {
        return std::clamp(static_cast<int>(std::floor((x + half) / kCell)), 0, cells - 1);
    };
    const auto visit = [&](const Segment& g, auto&& use) {
        const float reach = 1.3f * g.r0 + kWidestBlur;
        const int s0 = cell(std::min(g.s0, g.s1) - reach, half_width_, cells_s_);
        const int s1 = cell(std::max(g.s0, g.s1) + reach, half_width_, cells_s_);
        const int t0 = cell(std::min(g.t0, g.t1) - reach, half_height_, cells_t_);
        const int t1 = cell(std::max(g.t0, g.t1) + reach, half_height_, cells_t_);
        for (int t = t0; t <= t1; ++t) {
            for (int s = s0; s <= s1; ++s) {
                use(2 * static_cast<std::size_t>(t * cells_s_ + s) + (g.vein ? 0 : 1));
            }
        }
    };
    group_start_.assign(2 * static_cast<std::size_t>(cells_s_) * cells_t_ + 1, 0);
    for (const Segment& g : segments_) {
        visit(g, [&](std::size_t c) { ++group_start_[c + 1]; });
    }
    for (std::size_t c = 1; c < group_start_.size(); ++c) {
        group_start_[c] = group_start_[c - 1] + (group_start_[c] + kGroup - 1) / kGroup;
    }
    groups_.resize(static_cast<std::size_t>(group_start_.back()));
    std::vector<std::int32_t> used(group_start_.size(), 0);
    for (const Segment& g : segments_) {
        visit(g, [&](std::size_t c) {
            const int place = used[c]++;
            SegmentGroup& group = groups_[group_start_[c] + place / kGroup];
            const int k = place % kGroup;
            group.s0[k] = g.s0;
            group.t0[k] = g.t0;
            group.es[k] = g.s1 - g.s0;
            group.et[k] = g.t1 - g.t0;
            group.r0[k] = g.r0;
            group.dr[k] = g.r1 - g.r0;
        });
    }
}

void Tissue::tabulate() {
    table_columns_ = static_cast<int>(std::ceil(2.0f * half_width_ / kTableStep)) + 2;
    table_rows_ = static_cast<int>(std::ceil(2.0f * half_height_ / kTableStep)) + 2;
    table_.resize(static_cast<std::size_t>(table_columns_) * table_rows_);
    std::vector<float> columns;
    for (int i = 0; i < table_columns_; ++i) {
        columns.push_back(static_cast<float>(i) * kTableStep - half_width_);
    }
    OctaveRows wide(columns, 31.0f, seed_ + 1), mottle(columns, 5.3f, seed_ + 3),
        bed(columns, 9.0f, seed_ + 20), wetness(columns, 8.3f, seed_ + 44),
        slope_s(columns, 7.1f, seed_ + 40), slope_t(columns, 6.7f, seed_ + 42);
    Coarse* c = table_.data();
    for (int j = 0; j < table_rows_; ++j) {
        const float t = static_cast<float>(j) * kTableStep - half_height_;
        const float *wides = wide.at(t), *mottles = mottle.at(t), *beds = bed.at(t),
                    *wetnesses = wetness.at(t), *slopes_s = slope_s.at(t),
                    *slopes_t = slope_t.at(t);
        for (std::size_t i = 0; i < columns.size(); ++i, ++c) {
            c->wide = wides[i];
            c->patch = octave(columns[i] + 3.0f * c->wide, t - 2.0f * c->wide, 12.0f, seed_ + 2);
            c->mottle = mottles[i];
            c->bed = smooth_step(-0.15f, 0.35f, beds[i]);
            c->wetness = smooth_step(0.00f, 0.40f, wetnesses[i]);
            c->slope_s = slopes_s[i];
            c->slope_t = slopes_t[i];
        }
    }
}

Tissue::Coarse Tissue::coarse(float s, float t) const {
    const float x =
        std::clamp((s + half_width_) / kTableStep, 0.0f, static_cast<float>(table_columns_ - 2));
    const float y =
        std::clamp((t + half_height_) / kTableStep, 0.0f, static_cast<float>(table_rows_ - 2));
    const int i = static_cast<int>(x), j = static_cast<int>(y);
    const float fx = x - static_cast<float>(i), fy = y - static_cast<float>(j);
    const Coarse* row = table_.data() + static_cast<std::size_t>(j) * table_columns_ + i;
    const Coarse* below = row + table_columns_;
    const auto blend = [&](float Coarse::*m) {
        const float top = row[0].*m + fx * (row[1].*m - row[0].*m);
        const float bottom = below[0].*m + fx * (below[1].*m - below[0].*m);
        return top + fy * (bottom - top);
    };
    return {blend(&Coarse::wide),   blend(&Coarse::patch),   blend(&Coarse::mottle),
            blend(&Coarse::bed),    blend(&Coarse::wetness), blend(&Coarse::slope_s),
            blend(&Coarse::slope_t)};
}

Rgb Tissue::mottled(float s, float t, float footprint, const Coarse& c) const {
    float wavelength = 5.3f;
    float weight = 0.30f;
    float fine = weight * c.mottle;
    for (std::uint32_t i = 0; i < 4; ++i) {
        wavelength *= 0.49f;
        weight *= 0.86f;
        const float seen = resolved(wavelength, footprint);
        if (seen > 0.0f) {
            fine += seen * weight * octave(s, t, wavelength, seed_ + 4 + i);
        }
    }
    const float m = look_.mottling;
    const float fat = 0.42f * std::min(m, 1.0f) * smooth_step(0.16f, 0.85f, c.patch + 0.8f * fine);
    const float blood = 0.60f * std::min(m, 1.0f) *
                        smooth_step(0.10f, 0.60f, 0.5f * c.wide - c.patch + 0.5f * fine);
    Rgb albedo = mix(look_.base, {0.70f, 0.36f, 0.20f}, fat);
    albedo = mix(albedo, {0.40f, 0.055f, 0.045f}, blood);
    const float level =
        std::max(0.25f, 1.0f + m * (0.16f * c.wide + 0.20f * c.patch + 0.62f * fine));
    const float tint = m * 0.35f * fine;
    return Rgb{level, level * (1.0f + 0.6f * tint), level * (1.0f + 0.8f * tint)} * albedo;
}

float Tissue::darkest_of(std::int32_t first, std::int32_t last, float s, float t,
                         float footprint) const {
    constexpr float kPerLength = 1.0f / (kSegmentStep * kSegmentStep);
    const float least = 0.55f * footprint, blur = std::min(0.5f * footprint, 0.2f);
    float darkest = 0.0f;
    for (std::int32_t i = first; i < last; ++i) {
        const SegmentGroup& g = groups_[i];
        const Four ds = s - g.s0, dt = t - g.t0;
        Four along = (ds * g.es + dt * g.et) * kPerLength;
        along = along < 0.0f ? Four{} : along;
        along = along > 1.0f ? Four{} + 1.0f : along;
        const Four off_s = ds - along * g.es, off_t = dt - along * g.et;
        const Four radius = g.r0 + along * g.dr;
        const Four wide = radius < least ? Four{} + least : radius;
        const Four widest = radius + kWidestBlur;
        const Four shown = widest < wide ? widest : wide;
        const Four edge = 0.35f * radius + blur;
        const Four squared = off_s * off_s + off_t * off_t;
        const Four reach = (shown + edge) * (shown + edge);
        for (int k = 0; k < kGroup; ++k) {
            if (squared[k] >= reach[k]) {
                continue;
            }
            const float cover =
                1.0f - smooth_step(shown[k] - edge[k], shown[k] + edge[k], std::sqrt(squared[k]));
            const float dark = cover * (radius[k] / shown[k]) * std::min(1.0f, 0.45f + radius[k]);
            darkest = std::max(darkest, dark);
        }
    }
    return darkest;
}

Rgb Tissue::with_vessels(Rgb albedo, float s, float t, float footprint) const {
    const int cs = floor_to_int((s + half_width_) / kCell);
    const int ct = floor_to_int((t + half_height_) / kCell);
    if (cs < 0 || ct < 0 || cs >= cells_s_ || ct >= cells_t_) {
        return albedo;
    }
    const std::int32_t* first =
        group_start_.data() + 2 * static_cast<std::size_t>(ct * cells_s_ + cs);
    const float vein = darkest_of(first[0], first[1], s, t, footprint);
    const float artery = darkest_of(first[1], first[2], s, t, footprint);
    albedo = mix(albedo, Rgb{0.46f, 0.34f, 0.52f} * albedo, look_.vessels * vein);
    return mix(albedo, Rgb{0.62f, 0.26f, 0.28f} * albedo, look_.vessels * artery);
}

Rgb Tissue::with_capillaries(Rgb albedo, float s, float t, float footprint, const Coarse& c) const {
    const float bed = c.bed * resolved(0.35f, 0.6f * footprint);
    if (bed <= 0.0f) {
        return albedo;
    }
    const float warp = octave(s, t, 1.7f, seed_ + 21);
    const float ridge = std::abs(octave(s + 0.5f * warp, t + 0.8f * warp, 2.6f, seed_ + 22));
    const float thread = 1.0f - smooth_step(0.025f, 0.11f, ridge);
    return mix(albedo, Rgb{0.72f, 0.48f, 0.50f} * albedo, 0.75f * look_.vessels * bed * thread);
}

Rgb Tissue::with_spots(Rgb albedo, float s, float t, float footprint) const {
    constexpr float kPitch[2] = {1.9f, 4.7f};
    for (std::uint32_t i = 0; i < 2; ++i) {
        const float gs = s / kPitch[i], gt = t / kPitch[i];
        const int is = floor_to_int(gs), it = floor_to_int(gt);
        const std::uint32_t h = lattice_hash(is, it, seed_ + 30 + i);
        if ((h & 7u) > 2u) {
            continue;
        }
        const float radius = 0.06f + 0.13f * static_cast<float>((h >> 3) & 63u) / 63.0f;
        const float cs =
            radius + (1.0f - 2.0f * radius) * static_cast<float>((h >> 9) & 255u) / 255.0f;
        const float ct =
            radius + (1.0f - 2.0f * radius) * static_cast<float>((h >> 17) & 255u) / 255.0f;
        const float ds = gs - static_cast<float>(is) - cs, dt = gt - static_cast<float>(it) - ct;
        const float distance = std::sqrt(ds * ds + dt * dt);
        const float cover = (1.0f - smooth_step(0.35f * radius, radius, distance)) *
                            resolved(2.0f * radius * kPitch[i], 0.7f * footprint);
        const Rgb colour = (h >> 28) < 5u ? Rgb{1.28f, 1.45f, 1.40f} : Rgb{0.60f, 0.34f, 0.36f};
        albedo = mix(albedo, colour * albedo, 0.8f * look_.spots * cover);
    }
    return albedo;
}

Tissue::Sample Tissue::at(float s, float t, float footprint) const {
    s *= look_.detail;
    t *= look_.detail;
    footprint *= look_.detail;
    const Coarse c = coarse(s, t);
    Sample sample;
    sample.albedo = mottled(s, t, footprint, c);
    if (look_.vessels > 0.0f) {
        sample.albedo = with_capillaries(sample.albedo, s, t, footprint, c);
        sample.albedo = with_vessels(sample.albedo, s, t, footprint);
    }
    if (look_.spots > 0.0f) {
        sample.albedo = with_spots(sample.albedo, s, t, footprint);
    }
    sample.wetness = look_.gloss * (c.wetness + look_.wet_share * (1.0f - c.wetness));
    return sample;
}

Tissue::Film Tissue::film(float s, float t) const {
    s *= look_.detail;
    t *= look_.detail;
    const Coarse c = coarse(s, t);
    return {look_.film_relief * (0.16f * c.slope_s + 0.15f * octave(s, t, 1.3f, seed_ + 41)),
            look_.film_relief * (0.16f * c.slope_t + 0.15f * octave(s, t, 1.5f, seed_ + 43))};
}

}  // namespace defrec::cli
