// See disparity_monitor.hpp.
#include "sdk/tracking/monitors/disparity_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "backends/shared/motion.hpp"
#include "sdk/tracking/decisions/rig.hpp"

namespace defrec {
namespace {

using decisions::BaselineDrift;
using decisions::Zoom;
using Change = DisparityMonitor::Change;
using Places = DisparityMonitor::Places;

size_t step_of(size_t vertices) {
    return std::max<size_t>(
        1, (vertices + BaselineDrift::kMaxVertices - 1) / BaselineDrift::kMaxVertices);
}

std::array<float, 3> place_of(const defrec_surface_sample& sample) {
    constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
    if (sample.observation != DEFREC_OBSERVED) return {kNaN, kNaN, kNaN};
    return {sample.position[0], sample.position[1], sample.position[2]};
}
std::array<float, 3> place_of(const defrec_surface_point& vertex) {
    return {vertex.position[0], vertex.position[1], vertex.position[2]};
}

// Takes the places of every so many vertices.
template <class Vertices>
void take_places(const Vertices& vertices, std::vector<Places>& places) {
    places.clear();
    for (size_t i = 0; i + BaselineDrift::kPairStep < vertices.size();
         i += step_of(vertices.size()))
        places.push_back({place_of(vertices[i]), place_of(vertices[i + BaselineDrift::kPairStep])});
}

bool is_known(const std::array<float, 3>& place) { return !std::isnan(place[2]); }

double distance(const Places& places) {
    const Vec3<double> step = load3<double>(places[0].data()) - load3<double>(places[1].data());
    return std::sqrt(dot(step, step));
}

// Sums over places that are known at two times.
struct Sums {
    using Pixel = std::complex<double>;  // from the principal point over the focal length
    Pixel before = 0, now = 0, products = 0;
    double squares = 0, inverse_depth_before = 0, inverse_depth_now = 0, vertices = 0;
    double length_before = 0, length_now = 0, pairs = 0;
};

Sums sum_change(const TemplateData& data, std::span<const Places> before,
                std::span<const Places> now) {
    Sums sums;
    for (size_t i = 0; i < std::min(before.size(), now.size()); ++i) {
        const auto &p = before[i][0], &q = now[i][0];
        if (!is_known(p) || !is_known(q)) continue;
        const Sums::Pixel a = Sums::Pixel(p[0], p[1]) / double{p[2]},
                          b = Sums::Pixel(q[0], q[1]) / double{q[2]};
        sums.before += a;
        sums.now += b;
        sums.products += std::conj(a) * b;
        sums.squares += std::norm(a);
        sums.inverse_depth_before += 1 / double{p[2]};
        sums.inverse_depth_now += 1 / double{q[2]};
        ++sums.vertices;
        if (!is_known(before[i][1]) || !is_known(now[i][1])) continue;
        // The last one of a row and the first of the next are no pair.
        const double length = distance(before[i]);
        if (length > 2 * BaselineDrift::kPairStep * data.grid.spacing * p[2] / data.camera.fx)
            continue;
        sums.length_before += length;
        sums.length_now += distance(now[i]);
        ++sums.pairs;
    }
    return sums;
}

// Square of the vertices' RMS distance from their middle, over the focal length.
double squared_radius(const Sums& sums) {
    return (sums.squares - std::norm(sums.before) / sums.vertices) / sums.vertices;
}

std::optional<Change> change_of(const Sums& sums) {
    if (sums.vertices < BaselineDrift::kMinVertices || sums.pairs < BaselineDrift::kMinVertices ||
        !(squared_radius(sums) > 0) || !(sums.length_before > 0 && sums.length_now > 0))
        return std::nullopt;
    const Sums::Pixel similarity =
        (sums.products - std::conj(sums.before) * sums.now / sums.vertices) /
        (squared_radius(sums) * sums.vertices);
    return Change{
        std::log(sums.inverse_depth_now / (std::abs(similarity) * sums.inverse_depth_before)),
        std::log(sums.length_before / sums.length_now), std::log(similarity),
        (sums.now - sums.before) / sums.vertices,
        (sums.now - similarity * sums.before) / sums.vertices};
}

// The change that is beyond another one, which lasted for so many frames.
Change beyond(const Change& change, const Change& usual, double frames) {
    return {change.by_scale - frames * usual.by_scale, change.by_length - frames * usual.by_length,
            change.growth - frames * usual.growth, change.shift - frames * usual.shift,
            change.aside - frames * usual.aside};
}

// Whether the images' scale alone jumped, and depth with it. rest: beyond the usual change.
bool is_zoom(const Change& rest, double radius) {
    const double by = std::abs(rest.growth.real());
    return by >= Zoom::kLeast &&
           std::max({std::abs(rest.growth.imag()), std::abs(rest.aside) / radius,
                     std::abs(rest.by_scale), std::abs(rest.by_length)}) <= Zoom::kPure * by;
}

}  // namespace

void DisparityMonitor::make_room() {
    places_.reserve(BaselineDrift::kMaxVertices);
    places_now_.reserve(BaselineDrift::kMaxVertices);
}

void DisparityMonitor::reset() {
    const double zoom = zoom_;
    *this = {};
    zoom_ = zoom;
}

void DisparityMonitor::add_frame(const TemplateData& data,
                                 std::span<const defrec_surface_sample> samples) {
    take_places(samples, places_now_);
    ++age_;
    if (age_ > BaselineDrift::kOldest) {
        places_.clear();
        usual_.reset();
    }
    const Sums sums = sum_change(data, places_, places_now_);
    if (const std::optional<Change> change = change_of(sums)) {
        mean_disparity_ =
            data.camera.fx * data.camera.baseline_mm * sums.inverse_depth_now / sums.vertices;
        judge(data, *change, std::sqrt(squared_radius(sums)));
    } else if (!places_.empty()) {
        return;
    }
    places_.swap(places_now_);
    age_ = 0;
    if (drift_ != 0) confirm(data);
}

void DisparityMonitor::judge(const TemplateData& data, const Change& change, double radius) {
    const double frames = age_;
    const auto motion_px = [&](const Change& of) {
        return data.camera.fx * std::hypot(std::abs(of.shift), std::abs(of.growth) * radius);
    };
    if (settling_ > 0) return settle(change);
    if (usual_) {
        const Change rest = beyond(change, *usual_, frames);
        const double calm = std::min(motion_px(change) / frames, motion_px(*usual_)) +
                            BaselineDrift::kLeastMotion * data.width;
        const bool zooms = age_ == 1 && is_zoom(rest, radius);
        if (zooms || motion_px(rest) > frames * BaselineDrift::kJump * calm) {
            if (zooms) {
                new_zoom_ = rest.growth.real();
                growth_before_ = usual_->growth.real();
                change_zoom(new_zoom_);
            }
            usual_.reset();
            settling_ = BaselineDrift::kSettling;
            return;
        }
        if (rest.by_scale * rest.by_length > 0 &&
            std::min(std::abs(rest.by_scale), std::abs(rest.by_length)) >
                frames * BaselineDrift::kMinJump &&
            std::abs(rest.growth.real()) <
                BaselineDrift::kMaxScaleShare * std::abs(rest.by_scale)) {
            drift_ += rest.by_scale;  // lengths on slopes change by more
            if (std::abs(drift_) < BaselineDrift::kMinJump) drift_ = 0;
            unconfirmed_ = 0;
            return;
        }
    }
    usual_ = beyond({}, change, -1 / frames);
}

void DisparityMonitor::change_zoom(double by) {
    zoom_ += by;
    if (std::abs(zoom_) < Zoom::kLeast) zoom_ = 0;  // back
}

// After a jump. A camera that neared before it and goes on nearing neared in frames that are
// missing.
void DisparityMonitor::settle(const Change& change) {
    --settling_;
    if (new_zoom_ == 0) return;
    const double sign = new_zoom_ > 0 ? 1 : -1, after = change.growth.real() / age_;
    if (sign * growth_before_ > Zoom::kNears && sign * after > Zoom::kNears)
        change_zoom(-new_zoom_);
    new_zoom_ = 0;
}

// A drift that was none does not last: against the template, tissue that deforms may hide a drift
// from the lengths, and a camera that moves from the disparities, but seldom from both.
void DisparityMonitor::confirm(const TemplateData& data) {
    take_places(data.vertices, places_now_);
    const std::optional<Change> since_template = change_of(sum_change(data, places_now_, places_));
    if (!since_template) return;
    const double by_disparity = since_template->by_scale + since_template->growth.real();
    const bool confirms = std::max(since_template->by_length / drift_, by_disparity / drift_) >=
                          BaselineDrift::kConfirmingShare;
    unconfirmed_ = confirms ? std::max(0, unconfirmed_ - 1) : unconfirmed_ + 1;
    if (unconfirmed_ == BaselineDrift::kFramesToConfirm) drift_ = 0;
}

double DisparityMonitor::baseline_drift_px() const {
    return mean_disparity_ * (1 - std::exp(-drift_ - zoom_));
}

}  // namespace defrec
