// The tissue surface as a formula.
#include "sdk/scenes/surface.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/scenes/angles.hpp"
#include "sdk/scenes/noise.hpp"

namespace defrec::cli {
namespace {

/// 0..1, period 2 pi: a fast rise and a slower fall, as a beat has.
double beat(double phase) {
    return std::exp(1.6 * (std::cos(phase + 0.55 * std::sin(phase)) - 1.0));
}

/// The bodies of Surface::at, one for each cause; each adds to `moved`.
void add_heartbeat(const Heartbeat& h, double direction, double first_phase, double s, double t,
                   double time, Eigen::Vector3d& moved) {
    const double c = std::cos(direction), d = std::sin(direction);
    const double along = c * s + d * t;
    const double across = c * t - d * s;
    const double phase = kTwoPi * (time / h.period - along / h.wavelength) + first_phase;
    const double pulse = beat(phase);
    const double echo = std::sin(2.0 * phase - kTwoPi * across / (0.7 * h.wavelength));
    const double shear = h.shear * (std::sin(phase + 0.9) + 0.3 * echo);
    const double angle = h.twist * pulse * std::exp(-(s * s + t * t) / (2.0 * 32.0 * 32.0));
    const double here = 0.75 + 0.25 * std::sin(0.06 * across + 0.7);
    moved.x() += c * shear - angle * t;
    moved.y() += d * shear + angle * s;
    moved.z() -= here * h.lift * (pulse + 0.18 * echo);
}

void add_respiration(const Respiration& r, double s, double t, double time,
                     Eigen::Vector3d& moved) {
    const double phase = kTwoPi * time / r.period;
    const double breath = 0.5 - 0.5 * std::cos(phase + 0.35 * std::sin(phase));
    const double lag = 0.5 - 0.5 * std::cos(phase - 0.6);
    moved.x() += r.shift.x() * breath;
    moved.y() += r.shift.y() * lag;
    moved.z() -= r.swell * breath * std::exp(-(s * s + 1.4 * t * t) / (2.0 * 45.0 * 45.0));
}

void add_indentation(const Indentation& i, double s, double t, Eigen::Vector3d& moved) {
    const double ds = s - i.centre.x(), dt = t - i.centre.y();
    const double pit = std::exp(-(ds * ds + dt * dt) / (2.0 * i.sigma * i.sigma));
    // Tissue is drawn in towards the pit, as well as dragged along with the tip.
    const double draw = -0.02 * i.depth * pit;
    moved.x() += i.drag.x() * pit + draw * ds;
    moved.y() += i.drag.y() * pit + draw * dt;
    moved.z() += i.depth * pit;
}

void add_stretch(const Stretch& p, double s, double t, Eigen::Vector3d& moved) {
    const double fade = std::exp(-t * t / (2.0 * p.reach * p.reach));
    moved.x() += p.strain * p.reach * std::tanh(s / p.reach) * fade;
    moved.y() -= p.poisson * p.strain * p.reach * std::tanh(t / p.reach) *
                 std::exp(-s * s / (2.0 * p.reach * p.reach));
    moved.z() += 0.12 * p.strain * p.reach * std::exp(-(s * s + t * t) / (2.0 * p.reach * p.reach));
}

void add_pinch(const Pinch& p, double s, double t, Eigen::Vector3d& moved) {
    const double ds = s - p.centre.x(), dt = t - p.centre.y();
    const double squared = ds * ds + dt * dt;
    const double near = std::exp(-squared / (2.0 * p.gather_sigma * p.gather_sigma));
    moved.x() += near * (p.drag.x() - p.gather * ds);
    moved.y() += near * (p.drag.y() - p.gather * dt);
    moved.z() += p.depth * std::exp(-squared / (2.0 * p.sigma * p.sigma));
}

void add_pull(const Pull& p, double s, double t, Eigen::Vector3d& moved) {
    const double ds = (s - p.centre.x()) / p.reach, dt = (t - p.centre.y()) / p.reach;
    moved += std::exp(1.0 - std::sqrt(1.0 + ds * ds + dt * dt)) * p.by;
}

/// Width of the gap at s, mm; smooth where the cut ends.
double gap_at(const Incision& i, double s) {
    if (i.gap == 0) {
        return 0;
    }
    const double x = std::min(std::abs(s) / i.half_length, 1.0);
    return i.gap * (1.0 - x * x) * (1.0 - x * x);
}

void add_incision(const Incision& i, Side side, double s, double t, Eigen::Vector3d& moved) {
    const double sign = side == Side::above ? -1.0 : 1.0;
    const double gap = gap_at(i, s), from_line = sign * t;
    moved.y() += sign * 0.5 * gap * std::exp(-from_line / i.reach);
    // The sides swell where they are pushed together.
    moved.z() -= 0.12 * gap * std::exp(-from_line / (0.5 * i.reach));
}

void add_lobes(const Lobes& l, Side side, Eigen::Vector3d& moved) {
    const double sign = side == Side::above ? -0.5 : 0.5;
    moved.y() += sign * l.gap;
    moved.z() += sign * l.step;
    if (side == Side::below) {
        moved.head<2>() += l.slide;
    }
}

}  // namespace

Surface::Surface(double depth, double relief, std::uint64_t seed, double curvature, double bend)
    : depth_(depth), curvature_(curvature), bend_(bend) {
    Random random(seed ^ 0x5C3Full);
    for (std::size_t i = 0; i < bumps_.size(); ++i) {
        const double wavelength = random.uniform(22.0, 30.0) + 6.0 * static_cast<double>(i);
        const double direction = random.uniform(0.0, kTwoPi);
        bumps_[i] = {kTwoPi / wavelength * std::cos(direction),
                     kTwoPi / wavelength * std::sin(direction), random.uniform(0.0, kTwoPi),
                     relief * 0.022 * wavelength * random.uniform(0.7, 1.2)};
    }
    beat_direction_ = random.uniform(0.3, 1.0);
    beat_phase_ = random.uniform(0.0, kTwoPi);
}

double Surface::rest_height(double s, double t) const {
    double z = depth_ + bend_ * (0.0014 * s * s + 0.0021 * t * t + 0.05 * s - 0.04 * t);
    for (const Wave& wave : bumps_) {
        z += wave.amplitude * std::sin(wave.ks * s + wave.kt * t + wave.phase);
    }
    return z + 0.5 * curvature_ * s * s;
}

Eigen::Vector3d Surface::at(double s, double t, double time, const Motion& motion) const {
    return at(s, t, time, motion, t < 0 ? Side::above : Side::below);
}

Eigen::Vector3d Surface::at(double s, double t, double time, const Motion& motion,
                            Side side) const {
    if (motion.body) {
        return beneath(s, t, 0, *motion.body);
    }
    Eigen::Vector3d moved = rest(s, t, 0);
    if (motion.heartbeat.lift != 0 || motion.heartbeat.shear != 0) {
        add_heartbeat(motion.heartbeat, beat_direction_, beat_phase_, s, t, time, moved);
    }
    if (motion.respiration.swell != 0 || !motion.respiration.shift.isZero()) {
        add_respiration(motion.respiration, s, t, time, moved);
    }
    if (motion.indentation.depth != 0 || !motion.indentation.drag.isZero()) {
        add_indentation(motion.indentation, s, t, moved);
    }
    if (motion.stretch.strain != 0) {
        add_stretch(motion.stretch, s, t, moved);
    }
    if (motion.pinch.depth != 0 || motion.pinch.gather != 0) {
        add_pinch(motion.pinch, s, t, moved);
    }
    if (!motion.pull.by.isZero()) {
        add_pull(motion.pull, s, t, moved);
    }
    if (motion.incision.gap != 0) {
        add_incision(motion.incision, side, s, t, moved);
    }
    if (motion.lobes.step != 0) {
        add_lobes(motion.lobes, side, moved);
    }
    return moved;
}

Eigen::Vector3d Surface::beneath(double s, double t, std::size_t layer,
                                 const BodyMotion& motion) const {
    return motion.moved(rest(s, t, kBodyDepths[layer]), s, t, layer);
}

Eigen::Vector3d Surface::rest(double s, double t, double depth) const {
    return {s, t, rest_height(s, t) + depth};
}

Eigen::Vector3d Surface::floor_at(double s, double across, double time,
                                  const Motion& motion) const {
    const Eigen::Vector3d above = at(s, 0, time, motion, Side::above);
    const Eigen::Vector3d below = at(s, 0, time, motion, Side::below);
    const Eigen::Vector3d half = 0.5 * (below - above);
    Eigen::Vector3d point = across < 0 ? Eigen::Vector3d(above + (1.0 + across) * half)
                                       : Eigen::Vector3d(below - (1.0 - across) * half);
    const double squared = across * across;
    const double depth =
        motion.incision.floor * (1.0 - std::exp(-gap_at(motion.incision, s) / 2.5));
    point.z() += depth * (1.0 - squared * squared);
    return point;
}

}  // namespace defrec::cli
