// The scenes in which tissue is touched hard or cut, or lies in lobes.
#include "sdk/scenes/contact_scenes.hpp"

namespace defrec::cli {

FrameState pinch(const Setting& setting, double frame) {
    constexpr double kArrives = 8, kPeriod = 30, kPressed = 9, kReleases = 17, kReleased = 25;
    FrameState state;
    state.time = frame;
    const double t = frame;
    const Recurrence event = recurring(t, kArrives, kPeriod, kPeriod - kReleased);
    const double press =
        ease(0.0, kPressed, event.since) * (1.0 - ease(kReleases, kReleased, event.since));
    const double sideways = ease(0.6 * kPressed, kReleases, event.since) * press;
    state.motion.heartbeat = {
        .lift = 2.8, .shear = 1.1, .twist = 0.0, .period = 18, .wavelength = 90};
    state.motion.pinch = {.depth = setting.parameter("depth") * press,
                          .gather = (1.0 - std::sqrt(setting.parameter("area"))) * press,
                          .centre = event.centre,
                          .drag = sideways * setting.parameter("drag") *
                                  Eigen::Vector2d(std::cos(0.07 * t), std::sin(0.07 * t))};
    const Orbit orbit{
        .yaw = 2.0 * kDegree * std::sin(kTwoPi * t / 60.0),
        .shift = {1.5 * std::sin(kTwoPi * t / 55.0), 1.0 * std::sin(kTwoPi * t / 38.0), 0}};
    place_camera(state, orbit, setting);
    // Steeper than the wall of the pit.
    Instrument tool;
    tool.axis = Eigen::Vector3d(-0.46, 0.31, -0.83).normalized();
    const double hover = tool.radius + 6.0 * (1.0 - ease(0.0, 0.2, press));
    tool.tip = setting.surface->at(event.centre.x(), event.centre.y(), t, state.motion) -
               Eigen::Vector3d(0, 0, hover) + retracted(t, kArrives) * tool.axis;
    state.instruments.push_back(tool);
    return state;
}

FrameState grasp(const Setting& setting, double frame) {
    constexpr double kArrives = 6, kPeriod = 34, kTaken = 14, kReleases = 24, kReleased = 28;
    FrameState state;
    state.time = frame;
    const double t = frame;
    const Recurrence event = recurring(t, kArrives, kPeriod, kPeriod - kReleased);
    const double taken = ease(0.0, kTaken, event.since);
    const double held = taken * (1.0 - ease(kReleases, kReleased, event.since));
    const Eigen::Vector3d direction =
        Eigen::Vector3d(0.50 * std::cos(0.10 * t), 0.50 * std::sin(0.10 * t), -0.87).normalized();
    state.motion.heartbeat = {
        .lift = 2.6, .shear = 1.0, .twist = 0.0, .period = 19, .wavelength = 90};
    state.motion.pull = {.by = setting.parameter("distance") * held * direction,
                         .centre = event.centre};
    const Orbit orbit{
        .pitch = 2.0 * kDegree * std::sin(kTwoPi * t / 50.0),
        .shift = {1.5 * std::sin(kTwoPi * t / 61.0), 1.0 * std::sin(kTwoPi * t / 43.0), 0}};
    place_camera(state, orbit, setting);
    // Half of the tip lies in the fold that it holds; when it lets go the tissue falls away from
    // it.
    Instrument tool;
    tool.axis = Eigen::Vector3d(0.66, 0.36, -0.66).normalized();
    const double gone = ease(kReleases, kReleased, event.since);
    const double back = 1.0 - ease(kReleased, kPeriod, event.since);
    const Eigen::Vector3d lifted = setting.parameter("distance") * gone * back * direction -
                                   Eigen::Vector3d(0, 0, 0.5 * tool.radius);
    tool.tip = setting.surface->at(event.centre.x(), event.centre.y(), t, state.motion) + lifted +
               retracted(t, kArrives) * tool.axis;
    state.instruments.push_back(tool);
    return state;
}

FrameState two_instruments(const Setting& setting, double frame) {
    constexpr double kArrive = 14, kLeave = 46, kLeft = 58, kPeriod = 64;
    FrameState state;
    state.time = frame;
    const double t = frame;
    const double since = std::fmod(t, kPeriod);
    const double there = ease(2.0, kArrive, since) * (1.0 - ease(kLeave, kLeft, since));
    const double press =
        ease(0.9, 1.0, there) * (0.5 - 0.5 * std::cos(kTwoPi * (since - kArrive) / 20.0));
    const Eigen::Vector2d places[2] = {
        {6.0 + 3.0 * std::sin(kTwoPi * t / 40.0), -8.5 + 1.0 * std::sin(kTwoPi * t / 31.0)},
        {4.0 + 3.0 * std::sin(kTwoPi * t / 36.0), 7.5 + 1.0 * std::cos(kTwoPi * t / 29.0)}};
    state.motion.heartbeat = {
        .lift = 2.6, .shear = 1.0, .twist = 0.0, .period = 18, .wavelength = 90};
    state.motion.indentation = {.depth = 3.0 * press, .sigma = 7.0, .centre = places[0]};
    const Orbit orbit{.roll = 1.5 * kDegree * std::sin(kTwoPi * t / 52.0),
                      .shift = {1.0 * std::sin(kTwoPi * t / 57.0), 0, 0}};
    place_camera(state, orbit, setting);
    // Where the shafts enter the view, as shares of its width and height.
    const Eigen::Vector2d entries[2] = {{0.0, 0.35}, {1.0, 0.75}};
    for (int i = 0; i < 2; ++i) {
        const Eigen::Vector2d ray = setting.rig->left.ray(
            {entries[i].x() * setting.rig->width, entries[i].y() * setting.rig->height});
        const Eigen::Vector3d entry =
            setting.parameter("distance") * Eigen::Vector3d(ray.x(), ray.y(), 1.0);
        Instrument tool;
        tool.radius = setting.parameter("radius");
        const Eigen::Vector3d touched =
            setting.surface->at(places[i].x(), places[i].y(), t, state.motion) -
            Eigen::Vector3d(0, 0, tool.radius + (i == 0 ? 0.0 : 1.0));
        tool.axis = (entry - touched).normalized();
        tool.tip = touched + (1.0 - there) * 80.0 * tool.axis;
        state.instruments.push_back(tool);
    }
    return state;
}

FrameState cut(const Setting& setting, double frame) {
    FrameState state;
    state.time = frame;
    const double t = frame;
    const double open =
        ease(5.0, 25.0, t) *
        (1.0 - 0.3 * (0.5 - 0.5 * std::cos(kTwoPi * std::max(0.0, t - 29.0) / 24.0)));
    state.motion.heartbeat = {
        .lift = 2.8, .shear = 1.1, .twist = 0.0, .period = 18, .wavelength = 90};
    state.motion.incision = {.gap = setting.parameter("opening") * open,
                             .half_length = 0.5 * setting.parameter("length")};
    // The cut crosses the picture at a slant.
    const Orbit orbit{.roll = 35.0 * kDegree,
                      .shift = {2.0 + 1.5 * std::sin(kTwoPi * t / 59.0), -1.5, 0}};
    place_camera(state, orbit, setting);
    return state;
}

FrameState lobes(const Setting& setting, double frame) {
    FrameState state;
    state.time = frame;
    const double t = frame;
    state.motion.heartbeat = {
        .lift = 2.4, .shear = 0.9, .twist = 0.0, .period = 18, .wavelength = 90};
    const double phase = kTwoPi * t / 36.0;
    state.motion.lobes = {.step = setting.parameter("step"),
                          .slide = setting.parameter("slide") *
                                   Eigen::Vector2d(std::sin(phase), 0.08 - 0.08 * std::cos(phase))};
    // The step crosses the picture steeply.
    const Orbit orbit{.roll = 65.0 * kDegree, .shift = {1.5 * std::sin(kTwoPi * t / 59.0), 1.0, 0}};
    place_camera(state, orbit, setting);
    const double covered = setting.parameter("covered");
    if (covered > 0) {
        // As wide as the lobe below in the view, along the step.
        constexpr double kCovers = 8, kTravel = 6;
        const double there = ease(kCovers - kTravel, kCovers, t) *
                             (1.0 - ease(kCovers + covered, kCovers + covered + kTravel, t));
        Instrument tool;
        tool.axis = Eigen::Vector3d::UnitX();
        tool.radius = 13;
        tool.tip = {-60.0 + (1.0 - there) * 140.0, 15.0, 42.0};
        state.instruments.push_back(tool);
    }
    return state;
}

void deepen(const SceneParameters& /*parameters*/, Scene& scene) {
    scene.floor = TissueLook{.mottling = 0.35f,
                             .vessels = 0.3f,
                             .spots = 0.6f,
                             .gloss = 0.5f,
                             .base = {0.22f, 0.025f, 0.019f}};
}

}  // namespace defrec::cli
