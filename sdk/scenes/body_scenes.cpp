// The scenes whose tissue is an elastic body.
#include "sdk/scenes/body_scenes.hpp"

#include "sdk/scenes/bodies/loaded_layer.hpp"
#include "sdk/scenes/bodies/recorded_body.hpp"

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

    Recurrence at(double time) const { return recurring(time, first, period, period - over); }
    double share(const Recurrence& event) const {
        return ease(0.0, full, event.since) * (1.0 - ease(wanes, over, event.since));
    }
};

constexpr Contact kPress{.first = 5, .period = 30, .full = 10, .wanes = 14, .over = 24};

/// The tool comes down before the load grows.
double hover(double share) { return 6.0 * (1.0 - ease(0.0, 0.2, share)); }

/// A frame in which a load comes again and again, elsewhere. largest: mm, as BodyLoad::press.
FrameState touched(const Setting& setting, double time, const Contact& contact, double largest,
                   const Eigen::Vector3d& axis) {
    FrameState state = breathing_frame(setting, time);
    const Recurrence event = contact.at(time);
    const double share = contact.share(event);
    state.motion.body->load = {.centre = event.centre, .press = largest * share};
    add_tool(setting, axis, hover(share), contact.first, state);
    return state;
}

Body body_of(const Layer& layer, double width) {
    Body body;
    body.elastic = std::make_shared<LoadedLayer>(layer, width);
    if (const double h = layer.thickness; h > 0) {
        body.parts = {.whole = {{-70, -55, 0}, {70, 55, h}},
                      .held = {{-75, -60, h - 1}, {75, 60, h + 5}}};
        body.layers = static_cast<std::size_t>(
            std::lower_bound(kBodyDepths.begin(), kBodyDepths.end(), h) - kBodyDepths.begin());
    }
    return body;
}

/// The recording for the ratio that is asked for.
Body recorded_body(const SceneParameters& parameters, RecordedWords compressible,
                   RecordedWords nearly_incompressible, const BodyParts& parts) {
    const double poisson = parameters.at("poisson");
    if (poisson != 0.3 && poisson != 0.49) {
        throw RenderUsageError("this scene's body was computed for a poisson of 0.3 and of 0.49");
    }
    const auto elastic =
        std::make_shared<RecordedBody>(poisson == 0.3 ? compressible : nearly_incompressible);
    return {elastic, elastic->layers(), parts};
}

constexpr double kLargestTurn = 40;  // degrees, of the recorded bodies that are lifted

}  // namespace

FrameState body_indent(const Setting& setting, double time) {
    return touched(setting, time, kPress, setting.parameter("depth"), kSteep);
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
    add_tool(setting, kSteep, hover(press), kFirst, state);
    return state;
}

FrameState body_rigid(const Setting& setting, double time) {
    return breathing_frame(setting, time);
}

FrameState body_lift(const Setting& setting, double time) {
    constexpr double kFirst = 4, kLifted = 34, kLowers = 38, kLowered = 68, kPeriod = 70;
    FrameState state = breathing_frame(setting, time);
    const double since = std::fmod(time, kPeriod);
    state.motion.body->load.share = setting.parameter("turn") / kLargestTurn *
                                    ease(kFirst, kLifted, since) *
                                    (1.0 - ease(kLowers, kLowered, since));
    return state;
}

FrameState body_press(const Setting& setting, double time) {
    FrameState state = breathing_frame(setting, time);
    const double share = kPress.share(kPress.at(time));
    state.motion.body->load.share = setting.parameter("load") * share;
    add_tool(setting, kSteep, hover(share), kPress.first, state);
    return state;
}

Body half_space(const SceneParameters& parameters) {
    return body_of({.poisson = parameters.at("poisson")}, parameters.at("width"));
}

Body bonded_layer(const SceneParameters& parameters) {
    return body_of({.poisson = parameters.at("poisson"), .thickness = parameters.at("thickness")},
                   parameters.at("width"));
}

Body rigid_body(const SceneParameters& /*parameters*/) { return {}; }

Body organ_body(const SceneParameters& parameters) {
    return recorded_body(
        parameters, recorded::organ_030, recorded::organ_049,
        {.whole = {{-55, -40, 0}, {55, 40, 14}}, .held = {{-56, -41, -1}, {-49.5, 41, 15}}});
}

Body retracted_body(const SceneParameters& parameters) {
    return recorded_body(
        parameters, recorded::retract_030, recorded::retract_049,
        {.whole = {{-65, -45, 0}, {65, 45, 50}}, .held = {{-66, -46, -1}, {-59.5, 46, 51}}});
}

Body block_with_inclusion(const SceneParameters& parameters) {
    return recorded_body(parameters, recorded::inclusion_030, recorded::inclusion_049,
                         {.whole = {{-55, -45, 0}, {55, 45, 50}},
                          .held = {{-56, -46, 49}, {56, 46, 55}},
                          .inclusion = Ball{{9, -4, 18}, 8}});
}

SceneParameter poisson_parameter() {
    return {"poisson", 0.45, 0, 0.49, "", "Poisson's ratio of the tissue"};
}

SceneParameter recorded_poisson_parameter() {
    return {"poisson", 0.49, 0.3, 0.49, "", "Poisson's ratio of the tissue, one of these two"};
}

SceneParameter relief_parameter() {
    return {"relief", 0.3, 0,
            1,        "",  "of the surface at rest; 0: a plane, for which the solution is exact"};
}

SceneParameter tool_parameter(bool is_drawn) {
    return {"instrument", is_drawn ? 1.0 : 0.0, 0, 1, "", "0: none is drawn"};
}

SceneParameter turn_parameter() {
    return {"turn", kLargestTurn, 0, kLargestTurn, "degrees", "of the edge that is lifted"};
}

std::vector<SceneParameter> with_body_parameters(std::vector<SceneParameter> own) {
    own.push_back({"breathing", 3, 0, 10, "mm", "by which the whole body moves"});
    own.push_back({"camera", 1, 0, 2, "", "scales the camera's motion; 0: it is still"});
    return own;
}

}  // namespace defrec::cli
