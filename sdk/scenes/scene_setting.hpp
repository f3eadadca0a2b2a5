// What the functions of the scenes share: the scene's whole, a camera that orbits, easing in time,
// contacts that come again.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "sdk/scenes/angles.hpp"
#include "sdk/scenes/scene.hpp"

namespace defrec::cli {

using SceneParameters = std::map<std::string, double, std::less<>>;

/// What a scene's own function needs of the whole.
struct Setting {
    int frames;
    double depth;
    double phase;  ///< from the seed, rad
    const Surface* surface;
    const SceneParameters* parameters;
    const StereoRig* rig;
    std::uint64_t seed;                       ///< of this scene's organ
    std::shared_ptr<const ElasticBody> body;  ///< null: the scene has none

    int share(double x) const { return static_cast<int>(std::lround(x * frames)); }
    /// One of those that the scene's SceneInfo names.
    double parameter(std::string_view name) const { return parameters->find(name)->second; }
};

/// Camera that turns about a target in front of it. Angles in rad, lengths in mm.
struct Orbit {
    double yaw = 0, pitch = 0, roll = 0;
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();  ///< of target and camera
    double retreat = 0;                               ///< away from the target
};

inline CameraPose pose_of(const Orbit& orbit, double depth) {
    using Eigen::AngleAxisd;
    using Eigen::Vector3d;
    CameraPose pose;
    const Eigen::Matrix3d to_scene =
        (AngleAxisd(orbit.yaw, Vector3d::UnitY()) * AngleAxisd(orbit.pitch, Vector3d::UnitX()) *
         AngleAxisd(orbit.roll, Vector3d::UnitZ()))
            .toRotationMatrix();
    const Vector3d target = Vector3d(0, 0, depth) + orbit.shift;
    pose.rotation = to_scene.transpose();
    pose.centre = target - (depth + orbit.retreat) * to_scene.col(2);
    return pose;
}

/// What a hand or a holder adds to any camera: a few tenths of a mm.
inline void add_tremor(Orbit& orbit, double time, double phase) {
    orbit.shift += Eigen::Vector3d(
        0.12 * std::sin(0.61 * time + phase) + 0.07 * std::sin(1.53 * time),
        0.10 * std::sin(0.47 * time + 2.0 * phase), 0.14 * std::sin(0.39 * time + 1.0));
    orbit.roll += 0.0016 * std::sin(0.53 * time + phase);
    orbit.pitch += 0.0009 * std::sin(0.71 * time + 3.0 * phase);
}

/// At state.time, on an orbit with a hand's tremor.
inline void place_camera(FrameState& state, Orbit orbit, const Setting& setting) {
    add_tremor(orbit, state.time, setting.phase);
    state.camera = pose_of(orbit, setting.depth);
}

/// The scene's surface at the time and with the motion of a frame.
inline MeshFormula surface_of(const Setting& setting, const FrameState& state) {
    return [whole = *setting.surface, motion = state.motion, time = state.time](
               double s, double t) { return whole.at(s, t, time, motion); };
}

inline double ease(double low, double high, double x) {
    const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

/// A place and a time of an event that comes again elsewhere. Contact is 0 between the events.
struct Recurrence {
    double since;            ///< frames since the event began; negative before the first
    Eigen::Vector2d centre;  ///< material coordinates
};

/// Events every `period` frames from frame `first` on, at three places in turn. An instrument is
/// above the next place during the last `travel` frames of an event.
inline Recurrence recurring(double time, double first, double period, double travel) {
    static const Eigen::Vector2d kPlaces[] = {{-7.0, 3.0}, {11.0, -5.0}, {2.0, 7.0}};
    const double number = std::max(0.0, std::floor((time - first) / period));
    const auto place = [](double event) { return kPlaces[static_cast<long>(event) % 3]; };
    const double since = time - first - number * period;
    const double onwards = ease(period - travel, period, since);
    return {since, place(number) + onwards * (place(number + 1) - place(number))};
}

/// Along the shaft, mm: instruments come into the view after the first frame, so that the points
/// that they will touch are among those of points.csv.
inline double retracted(double time, double arrives) {
    return 45.0 * (1.0 - ease(0.0, arrives, time));
}

}  // namespace defrec::cli
