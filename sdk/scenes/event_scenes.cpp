// The scenes in which something of an operation happens to the tissue or lies on it.
#include "sdk/scenes/event_scenes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "sdk/scenes/noise.hpp"

namespace defrec::cli {
namespace {

/// A beat before a camera that sways.
FrameState beating(const Setting& setting, double time) {
    FrameState state;
    state.time = time;
    state.motion.heartbeat = {
        .lift = 2.6, .shear = 1.0, .twist = 0.0, .period = 18, .wavelength = 90};
    place_camera(
        state,
        {.roll = 2.0 * kDegree * std::sin(kTwoPi * time / 52.0),
         .shift = {1.5 * std::sin(kTwoPi * time / 57.0), 1.0 * std::sin(kTwoPi * time / 43.0), 0}},
        setting);
    return state;
}

/// The whole surface, whose points are followed, and one sheet of something else.
void lay_on_surface(Scene& scene, const Lattice& lattice, const Texture& texture) {
    scene.textures = {{.look = scene.look, .seed = scene.seed}, texture};
    scene.sheets = {whole_sheet(0), {.lattice = lattice, .texture = 1}};
}

/// Two shafts at an angle: a hook with its foot on the tissue.
FrameState retraction(const Setting& setting, double time) {
    constexpr double kArrives = 5, kRetracted = 22, kReleases = 44, kReleased = 54, kPeriod = 64;
    constexpr double kFoot = 9;  // mm
    static const Eigen::Vector2d kPlace(12.0, 2.0);
    FrameState state = beating(setting, time);
    const double since = std::fmod(time, kPeriod);
    const double held =
        ease(kArrives, kRetracted, since) * (1.0 - ease(kReleases, kReleased, since));
    const Eigen::Vector3d direction = Eigen::Vector3d(0.80, 0.10, -0.60).normalized();
    state.motion.pull = {
        .by = setting.parameter("distance") * held * direction, .reach = 9, .centre = kPlace};
    const double there =
        ease(0.0, kArrives, since) * (1.0 - ease(kReleased, kReleased + kArrives, since));
    Instrument shaft;
    shaft.radius = 2.0;
    shaft.axis = Eigen::Vector3d(0.75, 0.15, -0.64).normalized();
    shaft.tip = surface_of(setting, state)(kPlace.x(), kPlace.y()) +
                60.0 * (1.0 - there) * shaft.axis - Eigen::Vector3d(0, 0, shaft.radius);
    Instrument foot = shaft;
    foot.axis = Eigen::Vector3d(0, 1, 0.1).normalized();
    foot.length = kFoot;
    foot.tip -= 0.5 * kFoot * foot.axis;
    state.instruments = {shaft, foot};
    return state;
}

FrameState resting(const Setting& setting, double time) {
    constexpr double kFirst = 2, kTouches = 8, kPeriod = 120;
    FrameState state = beating(setting, time);
    const double since = std::fmod(time, kPeriod), leaves = kTouches + setting.parameter("rests");
    const double there = ease(kFirst, kTouches, since) * (1.0 - ease(leaves, leaves + 6, since));
    const double pressed = ease(0.9, 1.0, there) * setting.parameter("depth");
    static const Eigen::Vector2d kFrom(-10.0, 4.0), kTo(16.0, -7.0);
    state.motion.indentation = {.depth = pressed, .sigma = 8.0, .centre = 0.5 * (kFrom + kTo)};
    const MeshFormula surface = surface_of(setting, state);
    Instrument tool;
    tool.radius = 3.5;
    const Eigen::Vector3d above(0, 0, -tool.radius - 0.4);
    tool.tip = surface(kFrom.x(), kFrom.y()) + above;
    tool.axis =
        (surface(kTo.x(), kTo.y()) + above + Eigen::Vector3d(0, 0, -1.5) - tool.tip).normalized();
    tool.tip += 80.0 * (1.0 - there) * tool.axis;
    state.instruments.push_back(tool);
    return state;
}

// Gauze: a pad that is laid on the tissue, and moves with it from then on.

constexpr double kPadHalfWidth = 13, kPadHalfHeight = 9;  // mm
constexpr double kPadThickness = 1.2;                     // mm

void lay_pad(const SceneParameters& /*parameters*/, Scene& scene) {
    lay_on_surface(scene, centred_lattice(kPadHalfWidth, kPadHalfHeight, 0.5, 0.5),
                   {.look = {.mottling = 0.35f,
                             .vessels = 0,
                             .spots = 0.5f,
                             .gloss = 0,
                             .detail = 4,
                             .base = {0.80f, 0.76f, 0.72f}},
                    .half_width = 4 * kPadHalfWidth + 4,
                    .half_height = 4 * kPadHalfHeight + 4,
                    .seed = ~scene.seed});
}

FrameState gauze(const Setting& setting, double time) {
    constexpr double kArrives = 4, kLies = 18;
    FrameState state = beating(setting, time);
    const MeshFormula surface = surface_of(setting, state);
    const double removed = setting.parameter("stays") > 0
                               ? ease(kLies + setting.parameter("stays"),
                                      kLies + setting.parameter("stays") + 14, time)
                               : 0;
    const double away = 1.0 - ease(kArrives, kLies, time) * (1.0 - removed);
    const double low = ease(0.25, 0.0, away);
    const Eigen::Vector3d aside = 75.0 * away * Eigen::Vector3d(0.9, -0.35, -0.25).normalized();
    state.sheets = {
        surface, [=](double s, double t) -> Eigen::Vector3d {
            // Rounded towards its edges, and level while it is carried.
            const double x = std::min({kPadHalfWidth - std::abs(s), kPadHalfHeight - std::abs(t),
                                       kPadThickness}) /
                             kPadThickness;
            const double thick = kPadThickness * std::sqrt(std::max(x * (2.0 - x), 0.0));
            const Eigen::Vector3d lying = surface(s + 4, t - 3);
            const Eigen::Vector3d middle = surface(4, -3);
            const Eigen::Vector3d carried = middle + Eigen::Vector3d(s, t, -4.0);
            return low * lying + (1.0 - low) * carried + aside - Eigen::Vector3d(0, 0, thick + 0.1);
        }};
    return state;
}

// Thread: a suture that runs over the tissue in stitches and is pulled through.

constexpr double kThreadRadius = 0.3;  // mm
constexpr double kThreadLength = 60;   // mm, to both sides
constexpr double kStitch = 7;          // mm from one place where it goes down to the next

void lay_thread(const SceneParameters& /*parameters*/, Scene& scene) {
    const double half_round = std::numbers::pi * kThreadRadius;
    lay_on_surface(scene, centred_lattice(kThreadLength, half_round, 0.3, half_round / 5),
                   {.look = {.mottling = 0.2f,
                             .vessels = 0,
                             .spots = 0,
                             .gloss = 0.3f,
                             .base = {0.03f, 0.06f, 0.30f}},
                    .half_width = kThreadLength + 2,
                    .half_height = 4,
                    .seed = ~scene.seed});
}

FrameState thread(const Setting& setting, double time) {
    constexpr double kBegins = 3;
    FrameState state = beating(setting, time);
    const MeshFormula surface = surface_of(setting, state);
    // How far its end has come, and the loop that is still loose.
    const double end = -44.0 + setting.parameter("speed") * std::max(0.0, time - kBegins);
    state.sheets = {
        surface, [=](double s, double around) -> Eigen::Vector3d {
            const auto line = [&](double along) -> Eigen::Vector3d {
                const double before_end = std::clamp((end - along) / kStitch, 0.0, 2.0);
                const double loose = std::exp(-before_end * before_end);
                const double down = std::cos(kTwoPi * along / kStitch);
                const double side = 2.6 * std::sin(kTwoPi * along / (2.0 * kStitch));
                const Eigen::Vector3d on =
                    surface(along, -2.0 + side + 6.0 * std::sin(along / 21.0));
                return on - Eigen::Vector3d(0, 0, 0.8 * down + 0.3 + 5.0 * loose * (1 + down));
            };
            const double along = std::min(s, end);
            const Eigen::Vector3d forward = (line(along + 1e-3) - line(along - 1e-3)).normalized();
            const Eigen::Vector3d side = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
            const double angle = around / kThreadRadius, radius = s < end ? kThreadRadius : 0.0;
            return line(along) -
                   radius * (std::sin(angle) * side + std::cos(angle) * side.cross(forward));
        }};
    return state;
}

/// A wound that bleeds, and is washed clean again and again.
FrameState irrigation(const Setting& setting, double time) {
    constexpr double kFirst = 4, kPeriod = 22, kWashed = 15;
    FrameState state = beating(setting, time);
    const double since = std::fmod(std::max(0.0, time - kFirst), kPeriod);
    const double wells = ease(0.0, kWashed, since) * (1.0 - ease(kWashed, kPeriod - 2, since));
    Blood pool;
    // The jet drives it aside.
    const double driven = ease(kWashed, kPeriod - 2, since);
    pool.s = static_cast<float>(-4.0 + 16.0 * driven);
    pool.t = static_cast<float>(2.0 - 6.0 * driven);
    pool.seed = static_cast<std::uint32_t>(scramble(setting.seed ^ 0x3A5B));
    pool.time = 3.0 * time;
    pool.reach = static_cast<float>(setting.parameter("reach") * (1.4 * wells - 0.4));
    if (wells > 0) {
        state.blood = pool;
    }
    return state;
}

}  // namespace

std::vector<Entry> event_entries() {
    return {
        {{.name = "retraction",
          .summary = "a hook pulls the tissue aside and holds it",
          .parameters = {{"distance", 15, 0, 18, "mm", "by which the tissue is pulled"}}},
         kOrgan,
         0.8,
         0.70f,
         retraction},
        {{.name = "resting",
          .summary = "an instrument rests on the tissue for long and leaves",
          .parameters = {{"rests", 36, 1, 90, "frames", "on the tissue"},
                         {"depth", 2.5, 0, 5, "mm", "how far it presses the tissue in"}}},
         kOrgan,
         0.8,
         0.70f,
         resting},
        {{.name = "gauze",
          .summary = "a pad of gauze is laid on the tissue and stays",
          .parameters = {{"stays", 0, 0, 200, "frames", "until it is taken away; 0: it stays"}}},
         kOrgan,
         0.6,
         0.70f,
         gauze,
         lay_pad},
        {{.name = "thread",
          .summary = "a suture grows over the tissue, stitch by stitch",
          .parameters = {{"speed", 2.2, 0, 4, "mm/frame", "of the thread's end"}}},
         kOrgan,
         0.6,
         0.70f,
         thread,
         lay_thread},
        {{.name = "irrigation",
          .summary = "bleeding that is washed away again and again",
          .parameters = {{"reach", 15, 5, 25, "mm", "of the pool before it is washed away"}}},
         kOrgan,
         0.7,
         0.70f,
         irrigation},
    };
}

}  // namespace defrec::cli
