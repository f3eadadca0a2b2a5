// An elastic half-space or layer under Gaussian loads.
#include "sdk/scenes/bodies/loaded_layer.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/scenes/bodies/cubic.hpp"

namespace defrec::cli {
namespace {

constexpr double kReach = 160.0;  // mm: beyond it the displacement stays as it is there
constexpr double kSpacing = 0.5;  // mm between the radii of the table
constexpr double kLargest = 6.5;  // wave number times width, where the load's spectrum is 1e-9
constexpr int kPanels = 20;       // of the integral over wave numbers, with 8 nodes each
// Nodes and weights of Gauss and Legendre on -1..1, the positive half.
constexpr double kNodes[] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                             0.9602898564975363};
constexpr double kWeights[] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                               0.1012285362903763};

struct Bessel {
    double j0, j1, j2;
};

Bessel bessel(double x) {
    const double j0 = std::cyl_bessel_j(0.0, x), j1 = std::cyl_bessel_j(1.0, x);
    return {j0, j1, x > 1e-3 ? 2 * j1 / x - j0 : x * x / 8};
}

/// Responses at one depth, times weight.
struct Amplitudes {
    WaveAmplitudes press, drag;
    double across;
};

Amplitudes amplitudes_of(const GaussianLoad::Wave& wave, double z) {
    const auto scaled = [&](WaveAmplitudes a) {
        return WaveAmplitudes{wave.weight * a.along, wave.weight * a.down};
    };
    return {scaled(wave.response.to_pressure(z)), scaled(wave.response.to_traction(z)),
            wave.weight * wave.response.to_traction_across(z)};
}

void add(const Amplitudes& wave, const Bessel& j, RadialParts& sum) {
    sum.press_down += wave.press.down * j.j0;
    sum.press_out += wave.press.along * j.j1;
    sum.drag_even += 0.5 * (wave.drag.along + wave.across) * j.j0;
    sum.drag_once += wave.drag.down * j.j1;
    sum.drag_twice += 0.5 * (wave.drag.along - wave.across) * j.j2;
}

}  // namespace

GaussianLoad::GaussianLoad(const Layer& layer, double width) {
    const double half = 0.5 * kLargest / width / kPanels;
    for (int panel = 0; panel < kPanels; ++panel) {
        for (int node = 0; node < 8; ++node) {
            const int i = node / 2;
            const double k = half * (2 * panel + 1 + (node % 2 == 0 ? -kNodes[i] : kNodes[i]));
            const double spectrum = width * width * std::exp(-0.5 * k * k * width * width);
            waves_.push_back({k, half * kWeights[i] * spectrum * k, WaveResponse(layer, k)});
        }
    }
}

RadialParts GaussianLoad::at(double r, double z) const {
    RadialParts sum;
    for (const Wave& wave : waves_) {
        add(amplitudes_of(wave, z), bessel(wave.k * r), sum);
    }
    return sum;
}

LoadedLayer::LoadedLayer(const Layer& layer, double width) {
    const GaussianLoad load(layer, width);
    const RadialParts middle = load.at(0, 0);
    std::vector<std::vector<Amplitudes>> amplitudes;  // layer, wave
    for (const double depth : kBodyDepths) {
        if (layer.thickness == 0 || depth < layer.thickness) {
            auto& of_depth = amplitudes.emplace_back();
            for (const GaussianLoad::Wave& wave : load.waves()) {
                of_depth.push_back(amplitudes_of(wave, depth));
            }
        }
    }
    const auto radii = static_cast<std::size_t>(kReach / kSpacing) + 1;
    table_.assign(amplitudes.size(), std::vector<RadialParts>(radii));
    for (std::size_t i = 0; i < radii; ++i) {
        for (std::size_t w = 0; w < load.waves().size(); ++w) {
            const Bessel j = bessel(load.waves()[w].k * kSpacing * static_cast<double>(i));
            for (std::size_t d = 0; d < table_.size(); ++d) {
                add(amplitudes[d][w], j, table_[d][i]);
            }
        }
        for (auto& of_depth : table_) {
            RadialParts& parts = of_depth[i];
            parts.press_down /= middle.press_down;
            parts.press_out /= middle.press_down;
            parts.drag_even /= middle.drag_even;
            parts.drag_once /= middle.drag_even;
            parts.drag_twice /= middle.drag_even;
        }
    }
}

/// Catmull-Rom over r; at 0 the table goes on as its parts are even or odd.
RadialParts LoadedLayer::interpolated(double r, std::size_t layer) const {
    const std::vector<RadialParts>& row = table_[layer];
    const double place = std::min(r, kReach) / kSpacing;
    const auto last = static_cast<std::ptrdiff_t>(row.size()) - 1;
    const auto i = std::min(static_cast<std::ptrdiff_t>(place), last - 1);
    const double x = place - static_cast<double>(i);
    const auto weights = cubic_weights(x);
    RadialParts sum;
    for (std::ptrdiff_t node = 0; node < 4; ++node) {
        const std::ptrdiff_t at = i + node - 1;
        const RadialParts& parts = row[static_cast<std::size_t>(std::min(std::abs(at), last))];
        const double weight = weights[static_cast<std::size_t>(node)],
                     odd = at < 0 ? -weight : weight;
        sum.press_down += weight * parts.press_down;
        sum.press_out += odd * parts.press_out;
        sum.drag_even += weight * parts.drag_even;
        sum.drag_once += odd * parts.drag_once;
        sum.drag_twice += weight * parts.drag_twice;
    }
    return sum;
}

Eigen::Vector3d LoadedLayer::displacement(const BodyLoad& load, double s, double t,
                                          std::size_t layer) const {
    const Eigen::Vector2d from = Eigen::Vector2d(s, t) - load.centre;
    const double r = from.norm();
    const RadialParts parts = interpolated(r, layer);
    const Eigen::Vector2d out = r > 0 ? Eigen::Vector2d(from / r) : Eigen::Vector2d::Zero();
    Eigen::Vector3d moved;
    moved.head<2>() = load.press * parts.press_out * out;
    moved.z() = load.press * parts.press_down;
    // cos 2a and sin 2a of the angle between `out` and the drag, turned into the scene's axes.
    const Eigen::Vector2d& drag = load.drag;
    const Eigen::Vector2d mirrored = 2 * out.dot(drag) * out - out.squaredNorm() * drag;
    moved.head<2>() += parts.drag_even * drag - parts.drag_twice * mirrored;
    moved.z() -= parts.drag_once * out.dot(drag);
    return moved;
}

}  // namespace defrec::cli
