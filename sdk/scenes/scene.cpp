// The reference scenes.
#include "sdk/scenes/scene.hpp"

#include <algorithm>
#include <cstdio>

#include "sdk/scenes/body_scenes.hpp"
#include "sdk/scenes/camera_scenes.hpp"
#include "sdk/scenes/contact_scenes.hpp"
#include "sdk/scenes/event_scenes.hpp"
#include "sdk/scenes/microscope_scenes.hpp"
#include "sdk/scenes/noise.hpp"
#include "sdk/scenes/picture_scenes.hpp"
#include "sdk/scenes/piece_scenes.hpp"
#include "sdk/scenes/scene_entry.hpp"
#include "sdk/scenes/scene_setting.hpp"
#include "sdk/scenes/sliding_scenes.hpp"

namespace defrec::cli {
namespace {

FrameState heartbeat(const Setting& setting, double frame) {
    FrameState state;
    // One frame of the stream is lost and its predecessor shown again.
    const int lost = setting.share(0.55);
    state.repeats_previous = frame == lost && frame > 0;
    state.time = frame;
    state.motion.heartbeat = {
        .lift = 6.0, .shear = 2.2, .twist = 0.045, .period = 18, .wavelength = 75};
    state.motion.respiration = {.swell = 1.5, .shift = {1.5, 2.5}, .period = 75};
    place_camera(state, {}, setting);
    return state;
}

FrameState respiration(const Setting& setting, double frame) {
    FrameState state;
    state.time = frame;
    state.motion.respiration = {.swell = 8.0, .shift = {3.0, 7.0}, .period = 46};
    state.motion.heartbeat = {
        .lift = 1.5, .shear = 0.5, .twist = 0.0, .period = 19, .wavelength = 110};
    const double t = frame;
    const Orbit orbit{
        .yaw = 6.0 * kDegree * std::sin(kTwoPi * t / 72.0),
        .pitch = 4.0 * kDegree * std::sin(kTwoPi * t / 55.0 + 0.4),
        .roll = 7.0 * kDegree * std::sin(kTwoPi * t / 88.0),
        .shift = {5.0 * std::sin(kTwoPi * t / 64.0), 3.0 * std::sin(kTwoPi * t / 49.0), 0.0},
        .retreat = -9.0 * (0.5 - 0.5 * std::cos(kTwoPi * t / 60.0))};
    place_camera(state, orbit, setting);
    return state;
}

FrameState indentation(const Setting& setting, double frame) {
    FrameState state;
    state.time = frame;
    const double t = frame;
    const double press = 0.5 - 0.5 * std::cos(kTwoPi * std::max(0.0, t - 4.0) / 24.0);
    const Eigen::Vector2d centre(-3.0 + 13.0 * std::sin(kTwoPi * t / 52.0),
                                 1.0 - 8.0 * std::sin(kTwoPi * t / 41.0));
    state.motion.heartbeat = {
        .lift = 2.8, .shear = 1.1, .twist = 0.0, .period = 18, .wavelength = 90};
    state.motion.indentation = {
        .depth = setting.parameter("depth") * press,
        .sigma = 9.0,
        .centre = centre,
        .drag = press * Eigen::Vector2d(3.2 * std::cos(0.11 * t), 2.4 * std::sin(0.09 * t))};
    const Orbit orbit{
        .yaw = 3.0 * kDegree * std::sin(kTwoPi * t / 60.0),
        .roll = 2.0 * kDegree * std::sin(kTwoPi * t / 47.0),
        .shift = {2.5 * std::sin(kTwoPi * t / 55.0), 1.5 * std::sin(kTwoPi * t / 38.0), 0}};
    place_camera(state, orbit, setting);
    Instrument tool;
    tool.axis = Eigen::Vector3d(-0.62, 0.42, -0.66).normalized();
    const double hover = tool.radius + 5.0 * (1.0 - ease(0.0, 0.35, press));
    tool.tip =
        setting.surface->at(centre.x(), centre.y(), t, state.motion) - Eigen::Vector3d(0, 0, hover);
    state.instruments.push_back(tool);
    return state;
}

FrameState fast_cut(const Setting& setting, double frame) {
    FrameState state;
    state.time = frame;
    state.motion.heartbeat = {
        .lift = 3.6, .shear = 1.3, .twist = 0.0, .period = 18, .wavelength = 85};
    state.motion.respiration = {.swell = 2.0, .shift = {1.0, 1.0}, .period = 70};
    Orbit orbit;
    add_tremor(orbit, frame, setting.phase);
    if (frame >= setting.share(1.0 / 3.0)) {
        orbit.shift += Eigen::Vector3d(15.0, 2.0, 0.0);
        orbit.roll += 3.0 * kDegree;
    }
    if (frame >= setting.share(2.0 / 3.0)) {
        orbit.shift += Eigen::Vector3d(-19.0, -7.0, 0.0);
        orbit.retreat -= 5.0;
        orbit.roll -= 5.0 * kDegree;
    }
    state.camera = pose_of(orbit, setting.depth);
    return state;
}

FrameState out_of_body(const Setting& setting, double frame) {
    FrameState state;
    state.time = frame;
    state.motion.heartbeat = {
        .lift = 3.6, .shear = 1.3, .twist = 0.01, .period = 19, .wavelength = 80};
    state.motion.respiration = {.swell = 3.0, .shift = {1.0, 2.0}, .period = 70};
    const int leaves = std::max(1, setting.share(0.37)), dark_again = setting.share(0.53),
              returns = setting.share(0.60);
    const int bright = setting.share(0.43);
    const double t = frame;
    Orbit orbit{
        .shift = {0.8 * std::sin(kTwoPi * t / 50.0), 0.6 * std::sin(kTwoPi * t / 40.0), 0.0}};
    if (frame < leaves) {
        orbit.retreat = 16.0 * ease(leaves - 8, leaves, t);
    } else if (frame < returns) {
        state.outside = frame >= bright && frame < dark_again ? Outside::drape : Outside::dark;
    } else {
        orbit.yaw = 9.0 * kDegree;
        orbit.pitch = -5.0 * kDegree;
        orbit.roll = 10.0 * kDegree;
        orbit.shift += Eigen::Vector3d(-5.0, 2.5, 0.0);
        orbit.retreat = 6.0 - 9.0 * ease(returns, returns + 14, t);
    }
    place_camera(state, orbit, setting);
    return state;
}

FrameState smoke(const Setting& setting, double frame) {
    FrameState state;
    state.time = frame;
    const double t = frame;
    const double x = t / std::max(1, setting.frames - 1);
    state.motion.heartbeat = {
        .lift = 3.0, .shear = 1.1, .twist = 0.0, .period = 20, .wavelength = 95};
    state.motion.respiration = {.swell = 3.0, .shift = {2.0, 3.5}, .period = 46};
    state.smoke = {
        static_cast<float>(0.72 * ease(0.08, 0.45, x) * (1.0 - 0.8 * ease(0.70, 0.95, x))), t};
    const Orbit orbit{.yaw = 2.0 * kDegree * std::sin(kTwoPi * t / 66.0),
                      .shift = {2.0 * std::sin(kTwoPi * t / 58.0), 0, 0}};
    place_camera(state, orbit, setting);
    return state;
}

FrameState stretch(const Setting& setting, double frame) {
    FrameState state;
    state.time = frame;
    const double t = frame;
    state.motion.stretch = {
        .strain = 0.36 * (0.5 - 0.5 * std::cos(kTwoPi * t / 48.0)), .poisson = 0.4, .reach = 30};
    state.motion.respiration = {.swell = 1.5, .shift = {0.5, 1.5}, .period = 44};
    state.motion.heartbeat = {
        .lift = 1.8, .shear = 0.6, .twist = 0.0, .period = 20, .wavelength = 100};
    const Orbit orbit{.roll = 2.0 * kDegree * std::sin(kTwoPi * t / 70.0)};
    place_camera(state, orbit, setting);
    return state;
}

/// Whose organs are numbered.
std::vector<Entry> first_entries() {
    return {
        {{"heartbeat", "travelling beats with twist, a little breathing; one dropped frame"},
         {.mottling = 0.80f, .vessels = 0.9f, .spots = 0.8f},
         1.0,
         0.72f,
         heartbeat},
        {{"respiration", "swell and shift, moving and zooming camera; raw images", false},
         {.mottling = 0.70f, .vessels = 0.8f, .spots = 0.6f},
         0.9,
         0.70f,
         respiration},
        {{.name = "indentation",
          .summary = "an instrument in front presses and drags the tissue",
          .parameters = {{"depth", 7, 0, 12, "mm", "how far the tip presses the tissue in"}}},
         {.mottling = 0.42f, .vessels = 0.8f, .spots = 0.4f},
         0.8,
         0.68f,
         indentation},
        {{"fast-cut", "two jumps of 10 mm and more from one frame to the next"},
         {.mottling = 0.85f, .vessels = 0.8f, .spots = 0.8f},
         1.0,
         0.72f,
         fast_cut},
        {{"out-of-body", "camera leaves the body and returns to another viewpoint; raw images",
          false},
         {.mottling = 0.75f, .vessels = 0.9f, .spots = 0.7f},
         0.9,
         0.72f,
         out_of_body},
        {{"smoke", "smooth, poorly textured organ behind smoke, with highlights"},
         {.mottling = 0.42f,
          .vessels = 0.30f,
          .spots = 0.22f,
          .gloss = 1.5f,
          .base = {0.46f, 0.125f, 0.100f}},
         0.5,
         0.78f,
         smoke},
        {{"stretch", "tissue pulled by up to 36 %, with contraction across"},
         {.mottling = 0.48f, .vessels = 0.7f, .spots = 0.4f},
         0.7,
         0.70f,
         stretch},
    };
}

std::vector<Entry> instrument_entries() {
    return {
        {{.name = "pinch",
          .summary = "an instrument presses the tissue in and draws it together",
          .parameters = {{"depth", 11, 0, 13, "mm", "how far the tip presses the tissue in"},
                         {"area", 0.35, 0.25, 1, "", "what is left of the area under the tip"},
                         {"drag", 2.5, 0, 4, "mm", "how far the tip then goes sideways"}}},
         {.mottling = 0.75f, .vessels = 0.9f, .spots = 0.7f},
         0.8,
         0.70f,
         pinch},
        {{.name = "grasp",
          .summary = "an instrument takes the tissue, pulls it away and lets it go",
          .parameters = {{"distance", 12, 0, 15, "mm", "how far the tissue is pulled"}}},
         {.mottling = 0.75f, .vessels = 0.8f, .spots = 0.7f},
         0.8,
         0.70f,
         grasp},
        {{.name = "two-instruments",
          .summary = "two instruments with shadows cover much of the view, one presses",
          .parameters = {{"radius", 6, 2, 7, "mm", "of both instruments"},
                         {"distance", 32, 30, 60, "mm",
                          "from the camera, of the shafts where they enter the view"}}},
         {.mottling = 0.75f, .vessels = 0.9f, .spots = 0.7f},
         0.9,
         0.70f,
         two_instruments},
    };
}

std::vector<Entry> camera_entries() {
    return {
        {{.name = "approach",
          .summary = "the camera comes nearer and turns",
          .parameters = {{"distance", 0.6, 0.4, 1, "", "nearest, as a share of the first distance"},
                         {"turn", 15, 0, 25, "degrees", "largest"},
                         {"aside", 0, 0, 30, "mm", "largest motion to the right"}}},
         {.mottling = 0.80f, .vessels = 0.9f, .spots = 0.8f},
         0.9,
         0.66f,
         approach},
        {{.name = "roll",
          .summary = "the camera rolls about its axis and back",
          .parameters = {{"angle", 75, 0, 180, "degrees", "largest"}}},
         {.mottling = 0.80f, .vessels = 0.9f, .spots = 0.7f},
         0.9,
         0.70f,
         roll},
        {{.name = "slide",
          .summary = "the camera slides along curved tissue and turns with it",
          .parameters = {{"distance", 56, 0, 64, "mm", "along the tissue, within 45 frames"},
                         {"turn", 24, 0, 30, "degrees", "within these frames"},
                         {"period", 0, 0, 2000, "frames", "there and back; 0: there alone"}}},
         {.mottling = 0.80f, .vessels = 0.9f, .spots = 0.8f},
         0.9,
         0.70f,
         slide,
         nullptr,
         0.0047},
    };
}

/// Where the tissue is no longer one smooth sheet.
std::vector<Entry> gap_entries() {
    return {
        {{.name = "cut",
          .summary = "an incision opens and shows what lies below",
          .parameters = {{"opening", 9, 0, 12, "mm", "width of the gap"},
                         {"length", 36, 10, 50, "mm", "of the cut"}}},
         {.mottling = 0.80f, .vessels = 0.9f, .spots = 0.7f},
         0.8,
         0.70f,
         cut,
         deepen},
        {{.name = "lobes",
          .summary = "two lobes with a step between them slide on each other",
          .parameters = {{"step", 8, 1, 20, "mm", "of depth between the lobes"},
                         {"slide", 5, 0, 10, "mm", "of one lobe along the other, to either side"},
                         {"covered", 0, 0, 60, "frames",
                          "for which an instrument hides the lobe below, from frame 8"}}},
         {.mottling = 0.80f, .vessels = 0.9f, .spots = 0.7f},
         0.8,
         0.70f,
         lobes,
         deepen},
    };
}

/// The tissue of the scenes that are hard because of the picture or the rig.
constexpr TissueLook kPicturedOrgan{.mottling = 0.70f, .vessels = 0.8f, .spots = 0.6f};

std::vector<Entry> right_view_entries() {
    return {
        {{.name = "late-view",
          .summary = "the right view is late for a while",
          .parameters = {{"lag", 1, -2, 2, "frames", "of the right view; negative: early"},
                         {"from", 0.3, 0, 1, "", "share of the sequence at which the lag begins"},
                         {"to", 0.5, 0, 1, "", "share of the sequence at which it ends"}}},
         kPicturedOrgan,
         0.9,
         0.70f,
         late_view},
        {{.name = "misaligned",
          .summary = "the right view is low, rolled, brighter and compressed",
          .parameters =
              {{"offset_px", 1.2, -20, 20, "px", "by which all is lower in the right image"},
               {"roll_deg", 0.15, -5, 5, "degrees", "of the right view, lower at the right"},
               {"focal_ratio", 1, 0.9, 1.1, "", "focal length of the right view, true/calibrated"},
               {"exposure", 1.2, 0.3, 2, "", "of the right view, the left's is 1"},
               {"gamma", 1.1, 0.5, 2, "", "of the right view, the left's is 1"},
               {"quality", 60, 0, 100, "", "of JPEG, both views; 0: not compressed"},
               {"drift", 0, 0, 1, "", "share of the sequence in which the geometry drifts"}}},
         kPicturedOrgan,
         0.9,
         0.66f,
         misaligned,
         compress},
        {{.name = "sideways",
          .summary = "tissue moves along the rows; the right view is late, or turned",
          .parameters = {{"angle", 0, -90, 90, "degrees", "of the motion to the rows"},
                         {"speed", 0.3, 0.001, 2, "mm/frame", "of the tissue at its fastest"},
                         {"distance", 4, 0.1, 12, "mm", "to and fro"},
                         {"phase", 0, 0, 1, "",
                          "of the motion in the first frame; 0: rests, 0.25: fastest"},
                         {"swell", 0, 0, 10, "mm", "towards the camera while it moves"},
                         {"lag", 1, -2, 2, "frames", "of the right view; negative: early"},
                         {"vergence_deg", 0, -3, 3, "degrees",
                          "by which the right view is turned to the left"}}},
         kPicturedOrgan,
         0.9,
         0.70f,
         sideways},
    };
}

/// What hides the tissue.
std::vector<Entry> cover_entries() {
    return {
        {{.name = "blood",
          .summary = "a pool of blood spreads over the tissue",
          .parameters = {{"cover", 0.5, 0, 0.8, "", "share of the view that is covered at last"}}},
         kPicturedOrgan,
         0.7,
         0.72f,
         blood},
        {{.name = "heavy-smoke",
          .summary = "thick smoke, another cloud every few frames",
          .parameters = {{"density", 0.8, 0, 1, "", "share of the smoke where it is thickest"},
                         {"hold", 4, 1, 60, "frames", "from one cloud to the next"},
                         {"from", 0.1, 0, 1, "", "share of the sequence at which it begins"}}},
         kPicturedOrgan,
         0.8,
         0.72f,
         heavy_smoke},
    };
}

std::vector<Entry> recording_entries() {
    return {
        {{.name = "compressed",
          .summary = "both views after H.264 at a low rate",
          .parameters = {{"contrast", 0.5, 0, 1, "",
                          "of the encoded video, less loses more; 0: no H.264"},
                         {"quality", 0, 0, 100, "", "of JPEG before it; 0: no JPEG"}}},
         kPicturedOrgan,
         0.9,
         0.72f,
         compressed,
         compress},
        {{.name = "motion-blur",
          .summary = "fast motion during a long exposure",
          .parameters = {{"shutter", 0.6, 0, 1, "frames", "that the exposure lasts"},
                         {"speed", 1, 0.2, 2, "", "of the beat"}}},
         kPicturedOrgan,
         0.9,
         0.72f,
         motion_blur},
        {{.name = "headlight",
          .summary = "strong highlights that stay with the light while the camera moves",
          .parameters = {{"gloss", 2.5, 0, 10, "", "strength of the highlights"}}},
         {.mottling = 0.70f,
          .vessels = 0.8f,
          .spots = 0.6f,
          .wet_share = 0.8f,
          .film_relief = 0.4f},
         0.9,
         0.66f,
         headlight,
         polish},
        {{.name = "defocus",
          .summary = "blur that grows with the distance from a focus that moves",
          .parameters = {{"aperture", 3, 0, 6, "mm", "of the lens; 0: sharp everywhere"},
                         {"focus", 0, -30, 30, "mm",
                          "from the tissue's middle at rest, on average"},
                         {"breathing", 12, 0, 30, "mm", "by which the focus moves to and fro"}}},
         kPicturedOrgan,
         0.9,
         0.72f,
         defocus},
    };
}

/// Where the light is what is hard.
std::vector<Entry> light_entries() {
    return {
        {{.name = "sheen",
          .summary = "broad wet highlights that move with camera and tissue",
          .parameters = {{"lamps", 2, 1, 3, "", "beside the camera"},
                         {"gloss", 1, 0, 3, "", "strength of the highlights"},
                         {"exponent", 80, 8, 200, "", "of their lobes; less is broader"},
                         {"film", 0, 0, 3, "mm/frame", "by which the film's ripples move"}}},
         {.mottling = 0.70f, .vessels = 0.8f, .spots = 0.6f, .gloss = 0.2f, .wet_share = 0.9f},
         0.9,
         0.62f,
         sheen},
        {{.name = "fat",
          .summary = "pale tissue with almost no texture in low light",
          .parameters = {{"contrast", 0.14, 0, 1, "", "of the texture; other scenes have 0.7"},
                         {"light", 0.4, 0.05, 1, "", "other scenes have 1"},
                         {"noise", 1.3, 0, 4, "", "of the sensor; other scenes have 1"}}},
         {.gloss = 0.5f, .base = {0.66f, 0.47f, 0.24f}},
         0.7,
         0.72f,
         fat,
         pale},
    };
}

std::vector<Entry> microscope_entries() {
    const auto entry = [](const std::string& name, const std::string& summary,
                          const SceneParameter& apart, double field,
                          StereoRig (*rig)(const SceneParameters&, int, int)) {
        Entry it{{name, summary, false},
                 {.mottling = 0.80f, .vessels = 0.9f, .spots = 0.8f},
                 0.5,
                 0.66f,
                 microscope,
                 magnify};
        it.info.parameters = {
            apart,
            {"distance", 300, 150, 600, "mm", "from the views to where they meet"},
            {"field", field, 20, 120, "mm", "width of each view there"},
            {"aperture", 8, 0, 20, "mm", "of each view's lens; 0: sharp everywhere"},
            {"behind", 0, -20, 20, "mm", "by which the tissue lies behind the place of meeting"},
            {"gloss", 0.4, 0, 3, "", "strength of the highlights"}};
        it.rig = rig;
        return it;
    };
    return {
        entry("microscope", "a stereo microscope: parallel axes, principal points apart",
              {"baseline", 24, 10, 60, "mm", "between the views"}, 27.1, microscope_rig),
        entry("toe-in", "a stereo microscope of two cameras that are turned towards each other",
              {"angle", 12, 2, 25, "degrees", "between the axes of the views"}, 52, toe_in_rig),
    };
}

Entry body_entry(SceneInfo info, FrameState (*at)(const Setting&, double),
                 Body (*body)(const SceneParameters&)) {
    info.parameters = with_body_parameters(std::move(info.parameters));
    return {std::move(info), kOrgan, 0.8, 0.70f, at, nullptr, 0, body, 0};
}

/// What deforms a body.
struct Load {
    SceneParameter largest;  ///< how far it goes
    double width;            ///< mm
    bool has_tool;
};

/// A scene with a body under a load.
Entry loaded_entry(const std::string& name, const std::string& summary, const Load& load,
                   FrameState (*at)(const Setting&, double), Body (*body)(const SceneParameters&),
                   const std::vector<SceneParameter>& more = {}) {
    SceneInfo info{
        .name = name, .summary = summary, .parameters = {poisson_parameter(), load.largest}};
    info.parameters.push_back(
        {"width", load.width, 4, 15, "mm", "of the load, a Gaussian's standard deviation"});
    info.parameters.insert(info.parameters.end(), more.begin(), more.end());
    info.parameters.push_back(tool_parameter(load.has_tool));
    info.parameters.push_back(relief_parameter());
    return body_entry(std::move(info), at, body);
}

std::vector<Entry> body_entries() {
    return {
        loaded_entry("body-indent", "an elastic half-space is pressed in, with targets beneath",
                     {{"depth", 7, 0, 9, "mm", "of the pit"}, 6, true}, body_indent, half_space),
        loaded_entry("body-pull", "an elastic half-space is pulled up, with targets beneath",
                     {{"distance", 8, 0, 10, "mm", "of the pull"}, 9, false}, body_pull,
                     half_space),
        loaded_entry("body-stroke", "a load strokes over an elastic half-space and drags it along",
                     {{"depth", 5, 0, 8, "mm", "of the pit"}, 7, true}, body_stroke, half_space,
                     {{"drag", 3, 0, 5, "mm", "along the stroke"}}),
        loaded_entry("body-layer", "a layer on a rigid base is pressed in, with targets beneath",
                     {{"depth", 6, 0, 8, "mm", "of the pit"}, 6, true}, body_indent, bonded_layer,
                     {{"thickness", 35, 12, 80, "mm", "of the layer"}}),
        body_entry({.name = "body-rigid",
                    .summary = "a body that only moves rigidly, with targets beneath",
                    .parameters = {relief_parameter()}},
                   body_rigid, rigid_body),
        body_entry({.name = "body-organ",
                    .summary = "a thin organ that is held at one side bends, with targets inside",
                    .parameters = {recorded_poisson_parameter(), turn_parameter()}},
                   body_lift, organ_body),
        body_entry(
            {.name = "body-retract",
             .summary = "a thick block that is held at one side is lifted, with targets inside",
             .parameters = {recorded_poisson_parameter(), turn_parameter()}},
            body_lift, retracted_body),
        body_entry({.name = "body-inclusion",
                    .summary = "a block with a stiff ball in it is pressed in, with targets inside",
                    .parameters = {recorded_poisson_parameter(),
                                   {"load", 1, 0, 1, "", "share of the largest load"},
                                   tool_parameter(true)}},
                   body_press, block_with_inclusion),
    };
}

/// In the order in which they are listed.
const std::vector<Entry>& entries() {
    static const std::vector<Entry> table = [] {
        std::vector<Entry> all = first_entries();
        for (const auto& more :
             {instrument_entries(), camera_entries(), gap_entries(), right_view_entries(),
              cover_entries(), recording_entries(), light_entries(), piece_entries(),
              sliding_entries(), event_entries(), microscope_entries(), body_entries()}) {
            all.insert(all.end(), more.begin(), more.end());
        }
        return all;
    }();
    return table;
}

// The organs of the first scenes are numbered; those of later ones follow from their names, so that
// another scene changes none of them.
constexpr std::uint64_t kNumberedScenes = 7;

std::uint64_t hash_of(const std::string& name) {
    std::uint64_t hash = 0;
    for (const char c : name) {
        hash = scramble(hash ^ static_cast<unsigned char>(c));
    }
    return hash;
}

std::string number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", value);
    return text;
}

/// Every parameter of the scene with the value that it has.
SceneParameters parameters_of(const SceneInfo& scene, const std::vector<SceneSetting>& settings) {
    SceneParameters values;
    std::string known;
    for (const SceneParameter& p : scene.parameters) {
        values[p.name] = p.initial;
        known += (known.empty() ? "" : ", ") + p.name;
    }
    for (const SceneSetting& setting : settings) {
        const auto p = std::find_if(
            scene.parameters.begin(), scene.parameters.end(),
            [&](const SceneParameter& known_one) { return known_one.name == setting.parameter; });
        if (p == scene.parameters.end()) {
            throw RenderUsageError("scene '" + scene.name + "' has no parameter '" +
                                   setting.parameter + "'; " +
                                   (known.empty() ? "it has none" : "it has " + known));
        }
        if (!(setting.value >= p->lowest && setting.value <= p->highest)) {
            throw RenderUsageError("cannot set " + p->name + " of scene '" + scene.name + "' to " +
                                   number(setting.value) + "; " + number(p->lowest) + " to " +
                                   number(p->highest) + (p->unit.empty() ? "" : " " + p->unit) +
                                   " can be set");
        }
        values[p->name] = setting.value;
    }
    return values;
}

}  // namespace

std::vector<SceneInfo> list_scenes() {
    std::vector<SceneInfo> scenes;
    for (const Entry& entry : entries()) {
        scenes.push_back(entry.info);
    }
    return scenes;
}

Scene make_scene(const std::string& name, int width, int height, int frames, std::uint64_t seed,
                 const std::vector<SceneSetting>& settings) {
    const auto& table = entries();
    const auto entry = std::find_if(table.begin(), table.end(),
                                    [&](const Entry& e) { return e.info.name == name; });
    if (entry == table.end()) {
        std::string known;
        for (const Entry& e : table) {
            known += (known.empty() ? "" : ", ") + e.info.name;
        }
        throw RenderUsageError("there is no scene named '" + name + "'; the scenes are " + known);
    }
    const SceneParameters parameters = parameters_of(entry->info, settings);
    const StereoRig rig = entry->rig != nullptr ? entry->rig(parameters, width, height)
                                                : make_rig(width, height, entry->info.rectified);
    const auto place = static_cast<std::uint64_t>(entry - table.begin());
    const std::uint64_t own_seed =
        scramble(seed) ^ scramble(place < kNumberedScenes ? place : hash_of(name));
    // A body's parameter scales all that its surface departs from a plane by.
    const auto relief = parameters.find("relief");
    const double bend = relief != parameters.end() ? relief->second : entry->bend;
    const Surface surface(rig.depth, bend * entry->relief, own_seed, entry->curvature, bend);
    std::optional<Body> body;
    if (entry->body != nullptr) {
        body = entry->body(parameters);
    }
    const std::shared_ptr<const ElasticBody> elastic = body ? body->elastic : nullptr;
    const double phase = Random(own_seed ^ 0xCA3E7A).uniform(0.0, kTwoPi);
    const auto at = entry->at;
    Scene scene{.info = entry->info,
                .rig = rig,
                .look = entry->look,
                .seed = own_seed,
                .surface = surface,
                .exposure = entry->exposure,
                .body = body,
                .at = [=](double time) {
                    return at(
                        {frames, rig.depth, phase, &surface, &parameters, &rig, own_seed, elastic},
                        time);
                }};
    if (entry->adapt != nullptr) {
        entry->adapt(parameters, scene);
    }
    return scene;
}

}  // namespace defrec::cli
