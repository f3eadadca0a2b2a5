// The scenes whose tissue is an elastic body.
#include "sdk/cli/render/body_scenes.hpp"

#include "sdk/cli/render/bodies/loaded_layer.hpp"

namespace defrec::cli {
namespace {

/// A body that breathes: the whole of it is shifted and turned a little. `breathing` is in mm.
BodyMotion breathing_body(const Setting& setting, double time) {
    constexpr double kPeriod = 44, kTurn = 0.006;  // frames; rad about x for each mm
    const double breathing = setting.parameter("breathing");
    const double phase = kTwoPi * time / kPeriod;
    const double breath = breathing * (0.5 - 0.5 * std::cos(phase + 0.35 * std::sin(phase)));
    BodyMotion motion;
    motion.elastic = setting.body;
    motion.rotation =
        Eigen::AngleAxisd(kTurn * breath, Eigen::Vector3d::UnitX()).toRotationMatrix();
    const Eigen::Vector3d middle(0, 0, setting.depth);
    motion.translation =
        middle - motion.rotation * middle + breath * Eigen::Vector3d(0.25, 0.6, -0.76);
    return motion;
}

/// A frame with a breathing body before a camera that sways; `camera` scales the sway.
FrameState breathing_frame(const Setting& setting, double time) {
    FrameState state;
    state.time = time;
    state.motion.body = breathing_body(setting, time);
    const double sway = setting.parameter("camera");
    if (sway == 0) {
        state.camera = pose_of({}, setting.depth);
        return state;
    }
    const Orbit orbit{.yaw = 4.0 * sway * kDegree * std::sin(kTwoPi * time / 60.0),
                      .pitch = 2.5 * sway * kDegree * std::sin(kTwoPi * time / 47.0),
                      .roll = 2.0 * sway * kDegree * std::sin(kTwoPi * time / 53.0),
                      .shift = {3.0 * sway * std::sin(kTwoPi * time / 55.0),
                                2.0 * sway * std::sin(kTwoPi * time / 38.0), 0},
                      .retreat = 2.0 * sway * std::sin(kTwoPi * time / 49.0)};
    place_camera(state, orbit, setting);
    return state;
}

/// Where the parameter `instrument` asks for one: a thin tool above the load's centre, `hover` mm
/// off the surface.
void add_tool(const Setting& setting, const Eigen::Vector3d& axis, double hover, double arrives,
              FrameState& state) {
    if (setting.parameter("instrument") == 0) {
        return;
    }
    Instrument tool;
    tool.radius = 1.8;
    tool.axis = axis.normalized();
    const Eigen::Vector2d& centre = state.motion.body->load.centre;
    tool.tip = setting.surface->at(centre.x(), centre.y(), state.time, state.motion) -
               Eigen::Vector3d(0, 0, tool.radius + hover) +
               retracted(state.time, arrives) * tool.axis;
    state.instruments.push_back(tool);
}

/// A shaft that is steeper than the wall of a pit.
const Eigen::Vector3d kSteep(-0.46, 0.31, -0.83);

/// A load that grows, stays and goes. Frames; all but the first two from when it begins.
struct Contact {
    double first, period;
    double full, wanes, over;
};

/// A frame in which a load comes again and again, elsewhere. largest: mm, as BodyLoad::press.
FrameState touched(const Setting& setting, double time, const Contact& contact, double largest,
                   const Eigen::Vector3d& axis) {
    FrameState state = breathing_frame(setting, time);
    const Recurrence event =
        recurring(time, contact.first, contact.period, contact.period - contact.over);
    const double share = ease(0.0, contact.full, event.since) *
                         (1.0 - ease(contact.wanes, contact.over, event.since));
    state.motion.body->load.centre = event.centre;
    state.motion.body->load.press = largest * share;
    add_tool(setting, axis, 6.0 * (1.0 - ease(0.0, 0.2, share)), contact.first, state);
    return state;
}

Body body_of(const Layer& layer, double width) {
    Body body;
    body.elastic = std::make_shared<LoadedLayer>(layer, width);
    if (layer.thickness > 0) {
        body.layers = static_cast<std::size_t>(
            std::lower_bound(kBodyDepths.begin(), kBodyDepths.end(), layer.thickness) -
            kBodyDepths.begin());
    }
    return body;
}

}  // namespace

FrameState body_indent(const Setting& setting, double time) {
    constexpr Contact kContact{.first = 5, .period = 30, .full = 10, .wanes = 14, .over = 24};
    return touched(setting, time, kContact, setting.parameter("depth"), kSteep);
}

FrameState body_pull(const Setting& setting, double time) {
    constexpr Contact kContact{.first = 5, .period = 34, .full = 12, .wanes = 18, .over = 28};
    return touched(setting, time, kContact, -setting.parameter("distance"), {0.66, 0.36, -0.66});
}

FrameState body_stroke(const Setting& setting, double time) {
    constexpr double kFirst = 5, kPeriod = 34, kPressed = 5, kReleases = 25, kReleased = 30;
    static const Eigen::Vector2d kFrom(-15, 4), kTo(14, -3);
    FrameState state = breathing_frame(setting, time);
    const double number = std::max(0.0, std::floor((time - kFirst) / kPeriod));
    const double since = time - kFirst - number * kPeriod;
    const bool goes_back = static_cast<long>(number) % 2 == 1;
    const double way = ease(kPressed - 1, kReleases + 1, since);
    const double press = ease(0.0, kPressed, since) * (1.0 - ease(kReleases, kReleased, since));
    const double drag =
        ease(kPressed - 1, kPressed + 6, since) * (1.0 - ease(kReleases - 6, kReleased - 1, since));
    const Eigen::Vector2d direction = (goes_back ? -1.0 : 1.0) * (kTo - kFrom).normalized();
    BodyLoad& load = state.motion.body->load;
    load.centre = kFrom + (goes_back ? 1.0 - way : way) * (kTo - kFrom);
    load.press = setting.parameter("depth") * press;
    load.drag = setting.parameter("drag") * drag * direction;
    add_tool(setting, kSteep, 6.0 * (1.0 - ease(0.0, 0.2, press)), kFirst, state);
    return state;
}

FrameState body_rigid(const Setting& setting, double time) {
    return breathing_frame(setting, time);
}

Body half_space(const SceneParameters& parameters) {
    return body_of({.poisson = parameters.at("poisson")}, parameters.at("width"));
}

Body bonded_layer(const SceneParameters& parameters) {
    return body_of({.poisson = parameters.at("poisson"), .thickness = parameters.at("thickness")},
                   parameters.at("width"));
}

Body rigid_body(const SceneParameters& /*parameters*/) { return {}; }

SceneParameter poisson_parameter() {
    return {"poisson", 0.45, 0, 0.49, "", "Poisson's ratio of the tissue"};
}

std::vector<SceneParameter> with_body_parameters(std::vector<SceneParameter> own) {
    own.push_back({"breathing", 3, 0, 10, "mm", "by which the whole body moves"});
    own.push_back({"relief", 0.3, 0, 1, "",
                   "of the surface at rest; 0: a plane, for which the solution is exact"});
    own.push_back({"camera", 1, 0, 2, "", "scales the camera's motion; 0: it is still"});
    return own;
}

}  // namespace defrec::cli
