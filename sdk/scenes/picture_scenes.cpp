// The scenes that are hard because of the picture or the rig: a right view that is late or
// misaligned, blood, smoke, compression, blur and highlights. The tissue beats in all of them.
#include "sdk/scenes/picture_scenes.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/scenes/noise.hpp"

namespace defrec::cli {
namespace {

/// A beat with breathing, and a camera that sways; scenes change what they need.
FrameState beating(double time) {
    FrameState state;
    state.time = time;
    state.motion.heartbeat = {
        .lift = 3.6, .shear = 1.3, .twist = 0.01, .period = 18, .wavelength = 85};
    state.motion.respiration = {.swell = 2.0, .shift = {1.0, 2.0}, .period = 64};
    return state;
}

/// A share of the sequence, 0 in its first frame and 1 in its last.
double progress(const Setting& setting, double time) {
    return time / std::max(1, setting.frames - 1);
}

/// mm of half the view, at the depth of the tissue's middle.
Eigen::Vector2d half_view_of(const Setting& setting) {
    const StereoRig& rig = *setting.rig;
    return 0.5 * setting.depth * Eigen::Vector2d(rig.width / rig.left.fx, rig.height / rig.left.fy);
}

/// The reach of a pool that covers a share of the view at rest.
float reach_for(const Blood& blood, const Setting& setting, double share) {
    constexpr int kColumns = 64, kRows = 36;
    const Eigen::Vector2d half_view = half_view_of(setting);
    std::vector<float> reaches;
    reaches.reserve(std::size_t{kColumns} * kRows);
    for (int j = 0; j < kRows; ++j) {
        for (int i = 0; i < kColumns; ++i) {
            reaches.push_back(blood_reach(
                blood, static_cast<float>(half_view.x() * ((2 * i + 1.0) / kColumns - 1.0)),
                static_cast<float>(half_view.y() * ((2 * j + 1.0) / kRows - 1.0))));
        }
    }
    const auto place = static_cast<std::ptrdiff_t>(std::clamp(share, 0.0, 1.0) *
                                                   static_cast<double>(reaches.size() - 1));
    std::nth_element(reaches.begin(), reaches.begin() + place, reaches.end());
    return reaches[static_cast<std::size_t>(place)];
}

}  // namespace

FrameState late_view(const Setting& setting, double time) {
    FrameState state = beating(time);
    state.motion.heartbeat = {
        .lift = 5.0, .shear = 2.4, .twist = 0.03, .period = 18, .wavelength = 80};
    if (time >= setting.share(setting.parameter("from")) &&
        time < setting.share(setting.parameter("to"))) {
        state.right.lag = setting.parameter("lag");
    }
    place_camera(state,
                 {.shift = {1.6 * std::sin(kTwoPi * time / 31.0),
                            1.9 * std::sin(kTwoPi * time / 25.0 + 1.0), 0.0}},
                 setting);
    return state;
}

FrameState misaligned(const Setting& setting, double time) {
    FrameState state = beating(time);
    const double drift = setting.parameter("drift");
    const double share = drift > 0 ? std::clamp(progress(setting, time) / drift, 0.0, 1.0) : 1.0;
    state.right = {.offset = share * setting.parameter("offset_px"),
                   .roll = share * setting.parameter("roll_deg") * kDegree,
                   .focal_ratio = 1.0 + share * (setting.parameter("focal_ratio") - 1.0),
                   .exposure = static_cast<float>(setting.parameter("exposure")),
                   .gamma = static_cast<float>(setting.parameter("gamma"))};
    place_camera(state, {.shift = {1.5 * std::sin(kTwoPi * time / 52.0), 0.0, 0.0}}, setting);
    return state;
}

FrameState sideways(const Setting& setting, double time) {
    FrameState state;
    state.time = time;
    state.motion.respiration.swell = setting.parameter("swell");
    const double half = 0.5 * setting.parameter("distance"),
                 angle = setting.parameter("angle") * kDegree,
                 start = kTwoPi * setting.parameter("phase");
    // The speed is greatest where the phase is a quarter of a turn.
    const double phase = start + time * setting.parameter("speed") / half;
    state.motion.respiration.period = kTwoPi * half / setting.parameter("speed");
    state.right = {.lag = setting.parameter("lag"),
                   .vergence = setting.parameter("vergence_deg") * kDegree};
    const double along = half * (std::cos(start) - std::cos(phase));
    state.camera =
        pose_of({.shift = {-along * std::cos(angle), -along * std::sin(angle), 0}}, setting.depth);
    return state;
}

void compress(const SceneParameters& parameters, Scene& scene) {
    scene.compression.jpeg_quality =
        static_cast<int>(std::lround(parameters.find("quality")->second));
    if (const auto contrast = parameters.find("contrast"); contrast != parameters.end()) {
        scene.compression.h264_contrast = contrast->second;
    }
}

FrameState blood(const Setting& setting, double time) {
    FrameState state = beating(time);
    const double share = setting.parameter("cover") * ease(0.08, 0.75, progress(setting, time));
    if (share > 0) {
        Blood pool;
        const Eigen::Vector2d half_view = half_view_of(setting);
        pool.s = static_cast<float>(0.45 * half_view.x() * std::cos(setting.phase));
        pool.t = static_cast<float>(0.45 * half_view.y() * std::sin(setting.phase));
        pool.seed = static_cast<std::uint32_t>(scramble(setting.seed ^ 0xB1D0));
        pool.time = time;
        pool.reach = reach_for(pool, setting, share);
        state.blood = pool;
    }
    place_camera(state,
                 {.yaw = 2.0 * kDegree * std::sin(kTwoPi * time / 58.0),
                  .shift = {1.5 * std::sin(kTwoPi * time / 50.0), 0.0, 0.0}},
                 setting);
    return state;
}

FrameState heavy_smoke(const Setting& setting, double time) {
    FrameState state = beating(time);
    if (time >= setting.share(setting.parameter("from"))) {
        const auto puff = static_cast<std::uint64_t>(time / std::round(setting.parameter("hold")));
        const std::uint64_t random = scramble(setting.seed ^ scramble(0x5D0C + puff));
        const double share = Random(random).uniform(0.45, 1.0);
        state.smoke = {.density = static_cast<float>(share * setting.parameter("density")),
                       .time = time,
                       .thickness = 2.4f,
                       .pattern = static_cast<std::uint32_t>(random)};
    }
    place_camera(state, {.shift = {1.5 * std::sin(kTwoPi * time / 52.0), 0.0, 0.0}}, setting);
    return state;
}

FrameState compressed(const Setting& setting, double time) {
    FrameState state = beating(time);
    place_camera(state,
                 {.yaw = 2.0 * kDegree * std::sin(kTwoPi * time / 61.0),
                  .shift = {2.0 * std::sin(kTwoPi * time / 52.0),
                            1.2 * std::sin(kTwoPi * time / 43.0), 0.0}},
                 setting);
    return state;
}

FrameState motion_blur(const Setting& setting, double time) {
    FrameState state = beating(time);
    state.motion.heartbeat = {.lift = 6.0,
                              .shear = 3.2,
                              .twist = 0.03,
                              .period = 14.0 / setting.parameter("speed"),
                              .wavelength = 80};
    state.shutter = setting.parameter("shutter");
    place_camera(state,
                 {.shift = {2.5 * std::sin(kTwoPi * time / 23.0),
                            2.0 * std::sin(kTwoPi * time / 17.0), 0.0}},
                 setting);
    return state;
}

FrameState headlight(const Setting& setting, double time) {
    FrameState state = beating(time);
    place_camera(state,
                 {.yaw = 7.0 * kDegree * std::sin(kTwoPi * time / 48.0),
                  .pitch = 5.0 * kDegree * std::sin(kTwoPi * time / 37.0),
                  .shift = {3.0 * std::sin(kTwoPi * time / 44.0), 0.0, 0.0}},
                 setting);
    return state;
}

FrameState sheen(const Setting& setting, double time) {
    constexpr double kAside = 26;      // mm
    constexpr double kStrength = 4.6;  // at a gloss of 1
    FrameState state = beating(time);
    state.motion.heartbeat.lift = 2.0;
    place_camera(state,
                 {.yaw = 6.0 * kDegree * std::sin(kTwoPi * time / 48.0),
                  .pitch = 4.0 * kDegree * std::sin(kTwoPi * time / 37.0),
                  .shift = {3.0 * std::sin(kTwoPi * time / 44.0), 0.0, 0.0}},
                 setting);
    const auto lamps = static_cast<int>(std::lround(setting.parameter("lamps")));
    const Eigen::Vector3d between_views(0.5 * setting.rig->translation.norm(), 0, 0);
    for (int i = 0; i < lamps; ++i) {
        const double direction = setting.phase + kTwoPi * i / lamps;
        state.sheen.lamps.push_back(
            between_views +
            kAside * Eigen::Vector3d(std::cos(direction), 0.6 * std::sin(direction), 0));
    }
    state.sheen.strength = static_cast<float>(kStrength * setting.parameter("gloss"));
    state.sheen.exponent = static_cast<float>(setting.parameter("exponent"));
    state.sheen.moved = static_cast<float>(setting.parameter("film") * time);
    state.sheen.seed = static_cast<std::uint32_t>(scramble(setting.seed ^ 0x5EE4));
    return state;
}

FrameState fat(const Setting& setting, double time) {
    FrameState state = beating(time);
    state.exposure = static_cast<float>(setting.parameter("light"));
    place_camera(state,
                 {.yaw = 2.0 * kDegree * std::sin(kTwoPi * time / 58.0),
                  .shift = {1.5 * std::sin(kTwoPi * time / 50.0), 0.0, 0.0}},
                 setting);
    return state;
}

void pale(const SceneParameters& parameters, Scene& scene) {
    const auto contrast = static_cast<float>(parameters.find("contrast")->second);
    scene.look.mottling = scene.look.vessels = scene.look.spots = contrast;
    scene.noise = static_cast<float>(parameters.find("noise")->second);
}

void polish(const SceneParameters& parameters, Scene& scene) {
    scene.look.gloss = static_cast<float>(parameters.find("gloss")->second);
}

FrameState defocus(const Setting& setting, double time) {
    FrameState state = beating(time);
    state.focus = {.distance = setting.depth + setting.parameter("focus") +
                               setting.parameter("breathing") * std::sin(kTwoPi * time / 36.0),
                   .aperture = setting.parameter("aperture")};
    place_camera(state, {.shift = {1.5 * std::sin(kTwoPi * time / 52.0), 0.0, 0.0}}, setting);
    return state;
}

}  // namespace defrec::cli
