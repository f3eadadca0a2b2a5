// The scenes in which the camera moves far.
#include "sdk/scenes/camera_scenes.hpp"

namespace defrec::cli {

FrameState approach(const Setting& setting, double frame) {
    FrameState state;
    state.time = frame;
    const double t = frame;
    state.motion.heartbeat = {
        .lift = 2.8, .shear = 1.0, .twist = 0.0, .period = 19, .wavelength = 90};
    state.motion.respiration = {.swell = 1.5, .shift = {0.8, 1.5}, .period = 70};
    const double near = 0.5 - 0.5 * std::cos(kTwoPi * std::max(0.0, t - 4.0) / 80.0);
    const double turn = setting.parameter("turn") * kDegree * near;
    const double share = 1.0 - (1.0 - setting.parameter("distance")) * near;
    state.exposure = static_cast<float>(std::pow(share, 1.5));
    const Orbit orbit{.yaw = 0.8 * turn,
                      .pitch = -0.6 * turn,
                      .shift = {setting.parameter("aside") * near, 0, 0},
                      .retreat = (share - 1.0) * setting.depth};
    place_camera(state, orbit, setting);
    return state;
}

FrameState roll(const Setting& setting, double frame) {
    FrameState state;
    state.time = frame;
    const double t = frame;
    state.motion.heartbeat = {
        .lift = 2.8, .shear = 1.1, .twist = 0.01, .period = 18, .wavelength = 85};
    const double turned = 0.5 - 0.5 * std::cos(kTwoPi * std::max(0.0, t - 4.0) / 54.0);
    const Orbit orbit{.roll = setting.parameter("angle") * kDegree * turned,
                      .shift = {2.0 * std::sin(kTwoPi * t / 58.0), 0, 0}};
    place_camera(state, orbit, setting);
    return state;
}

FrameState slide(const Setting& setting, double frame) {
    FrameState state;
    state.time = frame;
    const double t = frame;
    state.motion.heartbeat = {
        .lift = 2.4, .shear = 0.9, .twist = 0.0, .period = 19, .wavelength = 90};
    const double period = setting.parameter("period");
    const double along =
        (period > 0 ? 0.5 - 0.5 * std::cos(kTwoPi * std::max(0.0, t - 4.0) / period)
                    : ease(4.0, 49.0, t)) -
        0.5;
    // Looks at the tissue at a right angle all the way.
    const Orbit orbit{.yaw = -setting.parameter("turn") * kDegree * along,
                      .shift = {setting.parameter("distance") * along, 0, 0}};
    place_camera(state, orbit, setting);
    return state;
}

}  // namespace defrec::cli
