// What the tissue looks like at a material point.
#include "sdk/cli/render/tissue.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sdk/cli/render/noise.hpp"

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

float octave(float s, float t, float wavelength, std::uint32_t seed) {
    return gradient_noise(s / wavelength + 0.37f, t / wavelength + 0.71f, seed);
}

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
                use(static_cast<std::size_t>(t * cells_s_ + s));
            }
        }
    };
    cell_start_.assign(static_cast<std::size_t>(cells_s_) * cells_t_ + 1, 0);
    for (const Segment& g : segments_) {
        visit(g, [&](std::size_t c) { ++cell_start_[c + 1]; });
    }
    for (std::size_t c = 1; c < cell_start_.size(); ++c) {
        cell_start_[c] += cell_start_[c - 1];
    }
    cell_items_.resize(static_cast<std::size_t>(cell_start_.back()));
    std::vector<std::int32_t> next(cell_start_.begin(), cell_start_.end() - 1);
    for (std::size_t i = 0; i < segments_.size(); ++i) {
        visit(segments_[i],
              [&](std::size_t c) { cell_items_[next[c]++] = static_cast<std::int32_t>(i); });
    }
}

void Tissue::tabulate() {
    table_columns_ = static_cast<int>(std::ceil(2.0f * half_width_ / kTableStep)) + 2;
    table_rows_ = static_cast<int>(std::ceil(2.0f * half_height_ / kTableStep)) + 2;
    table_.resize(static_cast<std::size_t>(table_columns_) * table_rows_);
    for (int j = 0; j < table_rows_; ++j) {
        for (int i = 0; i < table_columns_; ++i) {
            const float s = static_cast<float>(i) * kTableStep - half_width_;
            const float t = static_cast<float>(j) * kTableStep - half_height_;
            Coarse& c = table_[static_cast<std::size_t>(j) * table_columns_ + i];
            c.wide = octave(s, t, 31.0f, seed_ + 1);
            c.patch = octave(s + 3.0f * c.wide, t - 2.0f * c.wide, 12.0f, seed_ + 2);
            c.mottle = octave(s, t, 5.3f, seed_ + 3);
            c.bed = smooth_step(-0.15f, 0.35f, octave(s, t, 9.0f, seed_ + 20));
            c.wetness = smooth_step(0.00f, 0.40f, octave(s, t, 8.3f, seed_ + 44));
            c.slope_s = octave(s, t, 7.1f, seed_ + 40);
            c.slope_t = octave(s, t, 6.7f, seed_ + 42);
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

Rgb Tissue::with_vessels(Rgb albedo, float s, float t, float footprint) const {
    const int cs = floor_to_int((s + half_width_) / kCell);
    const int ct = floor_to_int((t + half_height_) / kCell);
    if (cs < 0 || ct < 0 || cs >= cells_s_ || ct >= cells_t_) {
        return albedo;
    }
    const std::size_t c = static_cast<std::size_t>(ct * cells_s_ + cs);
    float vein = 0.0f, artery = 0.0f;
    for (std::int32_t i = cell_start_[c]; i < cell_start_[c + 1]; ++i) {
        const Segment& g = segments_[cell_items_[i]];
        const float es = g.s1 - g.s0, et = g.t1 - g.t0;
        const float ds = s - g.s0, dt = t - g.t0;
        constexpr float kPerLength = 1.0f / (kSegmentStep * kSegmentStep);
        const float along = std::clamp((ds * es + dt * et) * kPerLength, 0.0f, 1.0f);
        const float off_s = ds - along * es, off_t = dt - along * et;
        const float radius = g.r0 + along * (g.r1 - g.r0);
        const float shown = std::min(std::max(radius, 0.55f * footprint), radius + kWidestBlur);
        const float edge = 0.35f * radius + std::min(0.5f * footprint, 0.2f);
        const float squared = off_s * off_s + off_t * off_t;
        if (squared >= (shown + edge) * (shown + edge)) {
            continue;
        }
        const float cover = 1.0f - smooth_step(shown - edge, shown + edge, std::sqrt(squared));
        const float dark = cover * (radius / shown) * std::min(1.0f, 0.45f + radius);
        float& darkest = g.vein ? vein : artery;
        darkest = std::max(darkest, dark);
    }
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
    const Coarse c = coarse(s, t);
    return {look_.film_relief * (0.16f * c.slope_s + 0.15f * octave(s, t, 1.3f, seed_ + 41)),
            look_.film_relief * (0.16f * c.slope_t + 0.15f * octave(s, t, 1.5f, seed_ + 43))};
}

}  // namespace defrec::cli
