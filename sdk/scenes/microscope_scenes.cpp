// The scenes that a stereo microscope sees: views that converge, a shallow depth of field, light
// through the objective.
#include "sdk/scenes/microscope_scenes.hpp"

namespace defrec::cli {
namespace {

constexpr double kOtherField = 76.8;  // mm, that the width shows in scenes of an endoscope

double parameter(const SceneParameters& parameters, std::string_view name) {
    return parameters.find(name)->second;
}

Working working_of(const SceneParameters& parameters) {
    return {parameter(parameters, "distance"), parameter(parameters, "field")};
}

}  // namespace

StereoRig microscope_rig(const SceneParameters& parameters, int width, int height) {
    return make_microscope(width, height, working_of(parameters),
                           parameter(parameters, "baseline"));
}

StereoRig toe_in_rig(const SceneParameters& parameters, int width, int height) {
    return make_toe_in(width, height, working_of(parameters),
                       parameter(parameters, "angle") * kDegree);
}

void magnify(const SceneParameters& parameters, Scene& scene) {
    scene.has_coaxial_light = true;
    scene.look.gloss = static_cast<float>(parameter(parameters, "gloss"));
    scene.look.detail = static_cast<float>(kOtherField / parameter(parameters, "field"));
}

FrameState microscope(const Setting& setting, double time) {
    FrameState state;
    state.time = time;
    const double scale = setting.parameter("field") / kOtherField;
    state.motion.heartbeat = {.lift = 3.6 * scale,
                              .shear = 1.3 * scale,
                              .twist = 0.01,
                              .period = 18,
                              .wavelength = 85 * scale};
    state.motion.respiration = {
        .swell = 2.0 * scale, .shift = {1.0 * scale, 2.0 * scale}, .period = 64};
    state.focus = {.distance = setting.depth + setting.parameter("behind"),
                   .aperture = setting.parameter("aperture")};
    // The point between the views looks at the tissue at a right angle; the left view stands half a
    // baseline aside and is turned by half the angle.
    const StereoRig& rig = *setting.rig;
    const Eigen::AngleAxisd half(0.5 * Eigen::AngleAxisd(rig.rotation).angle(),
                                 Eigen::Vector3d::UnitY());
    Orbit orbit{
        .shift = {0.8 * scale * std::sin(kTwoPi * time / 52.0), 0, 0},
        .retreat = setting.depth * (std::cos(half.angle()) - 1) + setting.parameter("behind")};
    place_camera(state, orbit, setting);
    CameraPose& left = state.camera;
    left.centre -= 0.5 * rig.translation.norm() * left.rotation.row(0).transpose();
    left.rotation = half.toRotationMatrix().transpose() * left.rotation;
    return state;
}

}  // namespace defrec::cli
