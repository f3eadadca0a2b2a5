// From what a view sees to its 8-bit picture.
#include "sdk/scenes/picture.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "sdk/scenes/noise.hpp"
#include "sdk/scenes/parallel_rows.hpp"

namespace defrec::cli {
namespace {

constexpr int kVeilStep = 8;  // px between samples of the smoke, which is smooth
constexpr float kHighlightFrom =
    0.93f;  // cosine below which the film's slopes cannot make a highlight
constexpr Rgb kSmokeColour{0.40f, 0.39f, 0.40f};
constexpr Rgb kThinBlood{0.30f, 0.022f, 0.018f};
constexpr Rgb kDeepBlood{0.13f, 0.007f, 0.008f};
constexpr float kMaxBlur = 16.0f;  // px, radius

/// x to the power of 2^squarings, for highlights.
float sharpened(float x, int squarings) {
    for (int i = 0; i < squarings; ++i) {
        x *= x;
    }
    return x;
}

/// Linear light 0..1 to grey levels by the usual power law.
const std::array<float, 4097>& tone_curve() {
    static const std::array<float, 4097> curve = [] {
        std::array<float, 4097> c{};
        for (std::size_t i = 0; i < c.size(); ++i) {
            c[i] =
                255.0f * static_cast<float>(std::pow(static_cast<double>(i) / 4096.0, 1.0 / 2.2));
        }
        return c;
    }();
    return curve;
}

std::uint8_t developed(float linear, const Sensor& sensor, float random, float noise) {
    const float position = std::clamp(linear, 0.0f, 1.0f) * 4096.0f;
    const int index = std::min(static_cast<int>(position), 4095);
    const auto& curve = tone_curve();
    float level =
        curve[index] + (position - static_cast<float>(index)) * (curve[index + 1] - curve[index]);
    if (sensor.gamma != 1.0f) {
        level = 255.0f * std::pow(level / 255.0f, sensor.gamma);
    }
    const float deviation = noise * (1.1f + 0.06f * std::sqrt(level + 1.0f));
    const float seen = std::clamp(level + sensor.offset + deviation * random, 0.0f, 255.0f);
    // NOLINTNEXTLINE(bugprone-incorrect-roundings): not negative; published pixels stay as they are
    return static_cast<std::uint8_t>(seen + 0.5f);
}

/// Roughly normal, mean 0, deviation 1, from 21 bits: the sum of three uniform numbers.
float bell(std::uint64_t bits) {
    const auto sum =
        static_cast<float>((bits & 127u) + ((bits >> 7) & 127u) + ((bits >> 14) & 127u));
    return (sum - 190.5f) * (1.0f / 64.0f);
}

Rgb drape_colour(const Eigen::Vector2f& ray, const Eigen::Vector3d& view_offset) {
    constexpr float kDistance = 260.0f;
    const float x = kDistance * ray.x() + static_cast<float>(view_offset.x());
    const float y = kDistance * ray.y() + static_cast<float>(view_offset.y());
    const float fold = gradient_noise(x / 90.0f, y / 40.0f, 77u) +
                       0.4f * gradient_noise(x / 31.0f, y / 23.0f, 78u);
    return (0.10f + 0.05f * fold) * Rgb{0.35f, 0.95f, 1.05f};
}

/// The surface of a pool: ripples, and a rounded edge.
Tissue::Film blood_film(const Blood& blood, float inside, float s, float t) {
    constexpr float kStep = 0.1f;
    const auto time = static_cast<float>(blood.time);
    const float here = blood_reach(blood, s, t);
    const float edge = 0.6f * std::exp(-std::max(inside, 0.0f) / 0.9f) / kStep;
    return {0.10f * gradient_noise((s - 0.22f * time) / 8.0f, t / 9.0f, blood.seed + 2) +
                edge * (blood_reach(blood, s + kStep, t) - here),
            0.10f * gradient_noise(s / 9.0f, (t + 0.17f * time) / 8.0f, blood.seed + 3) +
                edge * (blood_reach(blood, s, t + kStep) - here)};
}

/// The strength of the lobes of a rippled film at a point of the tissue. `turn`: from the scene to
/// the view.
float sheen_of(const Sheen& sheen, const Hit& hit, const Eigen::Vector3f& point,
               const Eigen::Vector3f& normal, const Eigen::Matrix3f& turn) {
    constexpr float kSlope = 0.16f;  // of the ripples
    const float s = hit.s - 0.8f * sheen.moved, t = hit.t + 0.6f * sheen.moved;
    const float slope_s = kSlope * gradient_noise(s / 13.0f, t / 11.0f, sheen.seed);
    const float slope_t = kSlope * gradient_noise(s / 11.0f, t / 13.0f, sheen.seed + 1);
    const Eigen::Vector3f rippled =
        (normal + slope_s * turn.col(0) + slope_t * turn.col(1)).normalized();
    const Eigen::Vector3f to_camera = -point.normalized();
    float sum = 0;
    for (const Eigen::Vector3d& lamp : sheen.lamps) {
        const Eigen::Vector3f to_lamp = (lamp.cast<float>() - point).normalized();
        const float glance = std::max(0.0f, rippled.dot((to_lamp + to_camera).normalized()));
        sum += std::pow(glance, sheen.exponent);
    }
    return sheen.strength * sum;
}

/// Brushed steel, lit from the lamp. `normal` and `point` in the view's frame.
Rgb steel_colour(const Eigen::Vector3f& point, const Eigen::Vector3f& normal, float along,
                 const Lighting& lighting) {
    const Eigen::Vector3f to_lamp = lighting.lamp.cast<float>() - point;
    const float distance = to_lamp.norm();
    const Eigen::Vector3f l = to_lamp / distance;
    const Eigen::Vector3f h = (l - point.normalized()).normalized();
    const float facing = std::max(0.0f, normal.dot(l));
    const float shine = std::max(0.0f, normal.dot(h));
    const float reach = static_cast<float>(lighting.distance) / distance;
    const bool ring = along > 8.0f && std::fmod(along, 9.0f) < 0.9f && along < 28.0f;
    const float brushed = 1.0f + 0.10f * gradient_noise(along * 2.3f, 3.0f * normal.x(), 55u);
    const float level =
        (0.05f + 0.30f * facing + 0.9f * sharpened(shine, 5)) * (ring ? 0.25f : 1.0f) * brushed;
    return std::min(reach * reach, 2.5f) * lighting.exposure * level * Rgb{0.93f, 0.97f, 1.0f};
}

/// A pixel's part of an instrument, in the view's frame.
struct Steel {
    const Instrument* instrument;
    Approach near;
    float cover;  ///< 0..1
};

Rgb steel_seen(const Steel& steel, const Eigen::Vector3d& direction, const Lighting& lighting) {
    const Instrument& instrument = *steel.instrument;
    const Approach& near = steel.near;
    const Eigen::Vector3d on_axis = instrument.tip + near.along_axis * instrument.axis;
    const Eigen::Vector3d across = direction - direction.dot(instrument.axis) * instrument.axis;
    const double inside = std::sqrt(
        std::max(0.0, instrument.radius * instrument.radius - near.distance * near.distance));
    const Eigen::Vector3d normal =
        (near.along_line * direction - on_axis - inside * across.normalized()).normalized();
    const Eigen::Vector3d point = on_axis + instrument.radius * normal;
    return steel_colour(point.cast<float>(), normal.cast<float>(),
                        static_cast<float>(near.along_axis), lighting);
}

/// instruments: in the view's frame. seen: scratch.
Rgb instruments_over(Rgb behind, const View& view, const Hit& hit, const Eigen::Vector2f& ray,
                     const std::vector<Instrument>& instruments, const Lighting& lighting,
                     std::vector<Steel>& seen) {
    const Eigen::Vector3d direction(ray.x(), ray.y(), 1.0);
    const double far = hit.z > 0 ? hit.z : 1000.0;
    seen.clear();
    for (const Instrument& instrument : instruments) {
        const Approach near =
            nearest_approach(instrument, Eigen::Vector3d::Zero(), direction, 1.0, far);
        const double pixel_mm = near.along_line / view.lens.fx;
        const double cover =
            std::clamp((instrument.radius - near.distance) / pixel_mm + 0.5, 0.0, 1.0);
        if (cover > 0) {
            seen.push_back({&instrument, near, static_cast<float>(cover)});
        }
    }
    std::sort(seen.begin(), seen.end(),
              [](const Steel& a, const Steel& b) { return a.near.along_line > b.near.along_line; });
    for (const Steel& steel : seen) {
        behind = mix(behind, steel_seen(steel, direction, lighting), steel.cover);
    }
    return behind;
}

}  // namespace

void Painter::expose(const View& view, const std::vector<Hit>& hits, const PictureRequest& request,
                     float share) {
    light_.resize(static_cast<std::size_t>(view.width) * view.height);
    exposed_.resize(light_.size());
    if (request.smoke.density > 0) {
        prepare_smoke(view, request);
    }
    parallel_rows(view.height, threads_,
                  [&](int first, int last) { paint_rows(view, hits, request, first, last); });
    if (request.focus.aperture > 0) {
        sharp_ = light_;
        parallel_rows(view.height, threads_, [&](int first, int last) {
            defocus_rows(view, hits, request.focus, first, last);
        });
    }
    for (std::size_t pixel = 0; pixel < light_.size(); ++pixel) {
        exposed_[pixel] = exposed_[pixel] + share * light_[pixel];
    }
}

void Painter::develop(const View& view, const Sensor& sensor, std::vector<std::uint8_t>& bgr) {
    bgr.resize(3 * exposed_.size());
    parallel_rows(view.height, threads_,
                  [&](int first, int last) { develop_rows(view, sensor, first, last, bgr); });
    exposed_.clear();
}

Rgb Painter::tissue_colour(const View& view, const Hit& hit, const Eigen::Vector2f& ray,
                           const PictureRequest& request,
                           const std::vector<Instrument>& instruments) const {
    const Eigen::Vector3f point(hit.z * ray.x(), hit.z * ray.y(), hit.z);
    const Eigen::Matrix3f turn = view.rotation.cast<float>();
    const Eigen::Vector3f normal = (turn * hit.normal).normalized();
    const Eigen::Vector3f to_lamp = request.lighting.lamp.cast<float>() - point;
    const float distance = to_lamp.norm();
    const Eigen::Vector3f l = to_lamp / distance;
    const Eigen::Vector3f to_camera = -point.normalized();

    const float footprint = hit.z / static_cast<float>(view.lens.fx);
    const Tissue& tissue = *looks_[hit.mesh];
    Tissue::Sample sample = tissue.at(hit.s, hit.t, footprint);
    const float inside = request.blood ? blood_inside(*request.blood, hit.s, hit.t) : 0.0f;
    const float cover = blood_cover(inside);
    if (cover > 0) {
        const Rgb blood = mix(kDeepBlood, kThinBlood, std::exp(-inside / 5.0f));
        sample.albedo = mix(sample.albedo, blood, cover);
        sample.wetness = (1.0f - cover) * sample.wetness + 1.5f * cover;
    }
    const Eigen::Vector3f half = (l + to_camera).normalized();
    const float facing = std::max(0.0f, normal.dot(l));
    const float glance = std::max(0.0f, normal.dot(half));
    float highlight = 0.05f * sharpened(glance, 4);
    if (sample.wetness > 0 && glance > kHighlightFrom) {
        const Tissue::Film film = cover > 0.5f ? blood_film(*request.blood, inside, hit.s, hit.t)
                                               : tissue.film(hit.s, hit.t);
        const Eigen::Vector3f rough =
            (normal + film.slope_s * turn.col(0) + film.slope_t * turn.col(1)).normalized();
        highlight += 3.5f * sample.wetness * sharpened(std::max(0.0f, rough.dot(half)), 9);
    }
    if (sample.wetness > 0 && request.sheen.strength > 0) {
        highlight += sample.wetness * sheen_of(request.sheen, hit, point, normal, turn);
    }

    const float reach = static_cast<float>(request.lighting.distance) / distance;
    float lit = reach * reach * request.lighting.exposure;
    float from_lamp = 1.0f;
    for (const Instrument& instrument : instruments) {
        const Approach shade =
            nearest_approach(instrument, point.cast<double>(), to_lamp.cast<double>(), 0.0, 1.0);
        const auto radius = static_cast<float>(instrument.radius);
        from_lamp *=
            smooth_step(0.85f * radius, 1.25f * radius, static_cast<float>(shade.distance));
    }
    if (!instruments.empty()) {
        lit *= 0.18f + 0.82f * from_lamp;
    }
    return lit * (facing * sample.albedo + highlight * Rgb{1.0f, 0.97f, 0.93f});
}

void Painter::paint_rows(const View& view, const std::vector<Hit>& hits,
                         const PictureRequest& request, int first, int last) {
    std::vector<Instrument> instruments;
    for (const Instrument& instrument : request.instruments) {
        instruments.push_back(view.from_scene(instrument));
    }
    std::vector<Steel> steel;
    const float corner =
        0.25f * static_cast<float>(view.width * view.width + view.height * view.height);
    for (int v = first; v < last; ++v) {
        for (int u = 0; u < view.width; ++u) {
            const std::size_t pixel = static_cast<std::size_t>(v) * view.width + u;
            const Eigen::Vector2f ray = view.rays[pixel];
            const Hit& hit = hits[pixel];
            Rgb colour{0.0008f, 0.0008f, 0.0008f};
            if (request.outside == Outside::drape) {
                colour = drape_colour(ray, request.view_offset);
            } else if (request.outside == Outside::none && hit.z > 0) {
                colour = tissue_colour(view, hit, ray, request, instruments);
            }
            if (request.outside == Outside::none) {
                colour =
                    instruments_over(colour, view, hit, ray, instruments, request.lighting, steel);
            }
            if (request.smoke.density > 0) {
                colour = mix(colour, kSmokeColour, smoke_at(u, v));
            }
            const float du = static_cast<float>(u) - 0.5f * static_cast<float>(view.width);
            const float dv = static_cast<float>(v) - 0.5f * static_cast<float>(view.height);
            light_[pixel] = (1.0f - 0.42f * (du * du + dv * dv) / corner) * colour;
        }
    }
}

/// Each pixel takes the mean of the disc in which its own point is blurred.
void Painter::defocus_rows(const View& view, const std::vector<Hit>& hits, const Focus& focus,
                           int first, int last) {
    for (int v = first; v < last; ++v) {
        for (int u = 0; u < view.width; ++u) {
            const std::size_t pixel = static_cast<std::size_t>(v) * view.width + u;
            const double z = hits[pixel].z;
            if (z <= 0) {
                continue;
            }
            const auto radius =
                std::min(kMaxBlur, static_cast<float>(0.5 * view.lens.fx * focus.aperture *
                                                      std::abs(1.0 / focus.distance - 1.0 / z)));
            const int reach = static_cast<int>(std::ceil(radius));
            Rgb sum;
            float weights = 0;
            for (int y = std::max(v - reach, 0); y <= std::min(v + reach, view.height - 1); ++y) {
                for (int x = std::max(u - reach, 0); x <= std::min(u + reach, view.width - 1);
                     ++x) {
                    const auto distance =
                        std::sqrt(static_cast<float>((x - u) * (x - u) + (y - v) * (y - v)));
                    const float weight = std::clamp(radius + 0.5f - distance, 0.0f, 1.0f);
                    sum = sum + weight * sharp_[static_cast<std::size_t>(y) * view.width + x];
                    weights += weight;
                }
            }
            light_[pixel] = (1.0f / weights) * sum;
        }
    }
}

void Painter::develop_rows(const View& view, const Sensor& sensor, int first, int last,
                           std::vector<std::uint8_t>& bgr) const {
    constexpr float kSide = 0.14f;
    const auto row_blur = [&](int u, int v) {
        const Rgb* row = exposed_.data() + static_cast<std::size_t>(v) * view.width;
        return kSide * (row[std::max(u - 1, 0)] + row[std::min(u + 1, view.width - 1)]) +
               (1.0f - 2.0f * kSide) * row[u];
    };
    for (int v = first; v < last; ++v) {
        const int above = std::max(v - 1, 0), below = std::min(v + 1, view.height - 1);
        for (int u = 0; u < view.width; ++u) {
            const std::size_t pixel = static_cast<std::size_t>(v) * view.width + u;
            const Rgb seen = sensor.gain * (kSide * (row_blur(u, above) + row_blur(u, below)) +
                                            (1.0f - 2.0f * kSide) * row_blur(u, v));
            const std::uint64_t bits = scramble(sensor.seed ^ (pixel * 0xD1B54A32D192ED03ull));
            bgr[3 * pixel] = developed(seen.b, sensor, bell(bits), 1.2f * sensor.noise);
            bgr[3 * pixel + 1] = developed(seen.g, sensor, bell(bits >> 21), sensor.noise);
            bgr[3 * pixel + 2] = developed(seen.r, sensor, bell(bits >> 42), 1.1f * sensor.noise);
        }
    }
}

void Painter::prepare_smoke(const View& view, const PictureRequest& request) {
    veil_columns_ = (view.width - 1) / kVeilStep + 2;
    const int rows = (view.height - 1) / kVeilStep + 2;
    veil_.resize(static_cast<std::size_t>(veil_columns_) * rows);
    const auto time = static_cast<float>(request.smoke.time);
    const std::uint32_t other = 100u * request.smoke.pattern;
    for (int j = 0; j < rows; ++j) {
        for (int i = 0; i < veil_columns_; ++i) {
            const std::size_t pixel =
                static_cast<std::size_t>(std::min(j * kVeilStep, view.height - 1)) * view.width +
                std::min(i * kVeilStep, view.width - 1);
            const Eigen::Vector2f ray = view.rays[pixel];
            float thickness = 0;
            constexpr float kLayers[3] = {28.0f, 44.0f, 62.0f};
            for (std::uint32_t layer = 0; layer < 3; ++layer) {
                const float x =
                    kLayers[layer] * ray.x() + static_cast<float>(request.view_offset.x());
                const float y =
                    kLayers[layer] * ray.y() + static_cast<float>(request.view_offset.y());
                const float curl =
                    gradient_noise(x / 14.0f, y / 14.0f + 0.05f * time, other + 61u + layer);
                thickness +=
                    0.40f + 0.45f * gradient_noise((x - 0.35f * time) / 17.0f + 0.6f * curl,
                                                   (y + 0.22f * time) / 15.0f + 0.5f * curl,
                                                   other + 71u + layer);
            }
            const float veil =
                1.0f - std::exp(-request.smoke.thickness * std::max(0.0f, thickness));
            veil_[static_cast<std::size_t>(j) * veil_columns_ + i] = request.smoke.density * veil;
        }
    }
}

float Painter::smoke_at(int u, int v) const {
    const int i = u / kVeilStep, j = v / kVeilStep;
    const float fu = static_cast<float>(u % kVeilStep) / kVeilStep;
    const float fv = static_cast<float>(v % kVeilStep) / kVeilStep;
    const float* row = veil_.data() + static_cast<std::size_t>(j) * veil_columns_ + i;
    const float top = row[0] + fu * (row[1] - row[0]);
    const float bottom = row[veil_columns_] + fu * (row[veil_columns_ + 1] - row[veil_columns_]);
    return top + fv * (bottom - top);
}

}  // namespace defrec::cli
