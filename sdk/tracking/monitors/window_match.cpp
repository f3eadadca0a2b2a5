// See window_match.hpp.
#include "sdk/tracking/monitors/window_match.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "sdk/template/check_patches.hpp"
#include "sdk/tracking/decisions/template_changes.hpp"

namespace defrec {
namespace {

using decisions::Slips;

constexpr int kSide = 2 * Slips::kWindowRadius + 1;
using Window = std::array<double, static_cast<size_t>(kSide* kSide)>;

struct Pixel {
    double u, v;
};

// Bilinear; false outside.
bool sample(const uint8_t* image, uint32_t width, uint32_t height, const Pixel& at, double& value) {
    const double left = std::floor(at.u), top = std::floor(at.v);
    if (!(left >= 0 && top >= 0 && left + 1 < width && top + 1 < height)) return false;
    const uint8_t* from = image + static_cast<size_t>(top) * width + static_cast<size_t>(left);
    const double a = at.u - left, b = at.v - top;
    value = (1 - b) * ((1 - a) * from[0] + a * from[1]) +
            b * ((1 - a) * from[width] + a * from[width + 1]);
    return true;
}

double correlation(const Window& a, const Window& b) {
    double sum_a = 0, sum_b = 0, aa = 0, bb = 0, ab = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        sum_a += a[i];
        sum_b += b[i];
        aa += a[i] * a[i];
        bb += b[i] * b[i];
        ab += a[i] * b[i];
    }
    const auto n = static_cast<double>(a.size());
    const double variance_a = aa - sum_a * sum_a / n, variance_b = bb - sum_b * sum_b / n;
    if (variance_a < n || variance_b < n) return 0;
    return (ab - sum_a * sum_b / n) / std::sqrt(variance_a * variance_b);
}

}  // namespace

std::optional<double> WindowMatch::zncc(const SurfacePlace& place,
                                        const DualQuaternion<double>& motion, Shift& shift) const {
    const defrec_camera& camera = data_.camera;
    const double step = 1 << check_level(data_);
    const auto project = [&](const Eigen::Vector3d& point) -> Pixel {
        const Vec3<double> p = apply(motion, {point.x(), point.y(), point.z()});
        return {camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy};
    };
    const Eigen::Vector3d& at = place.position;
    const Pixel rest{camera.fx * at.x() / at.z() + camera.cx,
                     camera.fy * at.y() / at.z() + camera.cy},
        centre = project(at), right = project(at + place.tangent_u),
        below = project(at + place.tangent_v);
    Window shown{}, live{};
    std::array<Pixel, std::tuple_size_v<Window>> places;
    size_t i = 0;
    for (int y = -Slips::kWindowRadius; y <= Slips::kWindowRadius; ++y)
        for (int x = -Slips::kWindowRadius; x <= Slips::kWindowRadius; ++x, ++i) {
            const double du = x * step, dv = y * step;
            if (!sample(data_.image.data(), data_.width, data_.height, {rest.u + du, rest.v + dv},
                        shown[i]))
                return std::nullopt;
            places[i] = {centre.u + du * (right.u - centre.u) + dv * (below.u - centre.u),
                         centre.v + du * (right.v - centre.v) + dv * (below.v - centre.v)};
        }
    double best = 0;
    bool is_any_inside = false;
    Shift found = shift;
    for (int y = shift.y - Slips::kSearchRadius; y <= shift.y + Slips::kSearchRadius; ++y)
        for (int x = shift.x - Slips::kSearchRadius; x <= shift.x + Slips::kSearchRadius; ++x) {
            bool is_inside = true;
            for (size_t k = 0; k < live.size() && is_inside; ++k)
                is_inside =
                    sample(image_.data(), data_.width, data_.height,
                           {places[k].u + x * step / 2, places[k].v + y * step / 2}, live[k]);
            if (!is_inside) continue;
            is_any_inside = true;
            const double score = correlation(shown, live);
            if (score <= best) continue;
            best = score;
            found = {x, y};
        }
    if (!is_any_inside) return std::nullopt;
    if (best >= Slips::kMinZncc) shift = found;
    return best;
}

}  // namespace defrec
