// The scenes in which tissue slides along other tissue, closes over itself or rolls.
#include "sdk/scenes/sliding_scenes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "sdk/scenes/noise.hpp"

namespace defrec::cli {
namespace {

constexpr TissueLook kOtherOrgan{
    .mottling = 0.75f, .vessels = 0.8f, .spots = 0.6f, .base = {0.60f, 0.210f, 0.150f}};

// Shear: organs side by side, of which the second slides one way and the third the other way. Their
// material has its own coordinates: s along the line of contact, t across it.

constexpr double kContactEdge = 1.0;      // mm by which an organ goes on beneath its neighbour
constexpr double kContactSpacing = 0.25;  // mm across the line
constexpr double kMiddleWidth = 16.0;     // mm, of the organ between two others
constexpr double kBesideContact = 0.5;    // mm, without points

/// From (s, t) to the plane of the picture: a circle about (0, 1/curvature), or a straight line.
struct ContactLine {
    double curvature;  ///< 1/mm

    Eigen::Vector2d at(double s, double t) const {
        if (curvature == 0) {
            return {s, t};
        }
        const double radius = 1.0 / curvature - t, angle = s * curvature;
        return {radius * std::sin(angle), 1.0 / curvature - radius * std::cos(angle)};
    }
};

/// One of the organs.
struct Contact {
    double first_t, last_t;  ///< mm, of its two lines of contact; infinite where it has none
    double lower;            ///< mm by which it lies below its neighbours; negative: above
    double share;            ///< of the slide

    /// mm beyond a line of contact; negative inside.
    double beyond(double t) const { return std::max(first_t - t, t - last_t); }
};

std::vector<Contact> contacts_of(const SceneParameters& parameters) {
    constexpr double kNone = std::numeric_limits<double>::infinity();
    const double step = parameters.at("step");
    if (std::lround(parameters.at("bodies")) == 2) {
        return {{-kNone, 0, -step, 0}, {0, kNone, step, 1}};
    }
    return {{-kNone, -0.5 * kMiddleWidth, -step, 0},
            {-0.5 * kMiddleWidth, 0.5 * kMiddleWidth, step, 1},
            {0.5 * kMiddleWidth, kNone, -step, -0.6}};
}

void lay_contacts(const SceneParameters& parameters, Scene& scene) {
    const double curvature = parameters.at("curvature");
    // Material ends before the centre of a curved line.
    const double highest =
        curvature > 0 ? std::min(kTissueHalfHeight, 0.9 / curvature) : kTissueHalfHeight;
    const std::vector<Contact> contacts = contacts_of(parameters);
    for (std::size_t i = 0; i < contacts.size(); ++i) {
        const Contact& contact = contacts[i];
        const double first = std::max(contact.first_t - kContactEdge, -kTissueHalfHeight);
        const double last = std::min(contact.last_t + kContactEdge, highest);
        Lattice lattice = centred_lattice(kTissueHalfWidth, 1, kTissueSpacing, kContactSpacing);
        lattice.first_t = first;
        lattice.rows = static_cast<int>(std::floor((last - first) / kContactSpacing)) + 1;
        scene.textures.push_back({.look = i == 1 ? kOtherOrgan : kOrgan,
                                  .seed = i == 0 ? scene.seed : scramble(scene.seed ^ i)});
        scene.sheets.push_back(
            {.lattice = lattice, .texture = i, .has_points = [contact](const Eigen::Vector2d& m) {
                 return contact.beyond(m.y()) < -kBesideContact;
             }});
    }
}

/// An organ's surface: that of the whole scene where the organ is, with a relief of its own that
/// ends at the line, where it meets its neighbour without a gap. Beyond the line it goes down.
MeshFormula organ_in_contact(const Contact& contact, const ContactLine& line, double slid,
                             const MeshFormula& whole, const Surface& relief) {
    return [=](double s, double t) -> Eigen::Vector3d {
        constexpr double kReliefBegins = 7.0;  // mm
        const Eigen::Vector2d place = line.at(s + slid, t);
        Eigen::Vector3d point = whole(place.x(), place.y());
        const double beyond = contact.beyond(t), inside = std::max(-beyond, 0.0) / kReliefBegins;
        point.z() += relief.rest(s, t, 0).z() * (1.0 - std::exp(-inside * inside)) +
                     std::max(contact.lower, 0.0);
        if (beyond > 0) {
            point.z() += beyond + std::max(-contact.lower, 0.0) * ease(0.0, kContactEdge, beyond);
        }
        return point;
    };
}

FrameState shear(const Setting& setting, double time) {
    constexpr double kBegins = 4, kPeriod = 40;
    FrameState state;
    state.time = time;
    state.motion.heartbeat = {
        .lift = 2.2, .shear = 0.8, .twist = 0.0, .period = 18, .wavelength = 90};
    const double out = 0.5 - 0.5 * std::cos(kTwoPi * std::max(0.0, time - kBegins) / kPeriod);
    const ContactLine line{setting.parameter("curvature")};
    const MeshFormula whole = surface_of(setting, state);
    const std::vector<Contact> contacts = contacts_of(*setting.parameters);
    for (std::size_t i = 0; i < contacts.size(); ++i) {
        constexpr double kRelief = 0.5;
        const Surface relief(0, kRelief, scramble(setting.seed ^ (0x511DE + i)), 0, 0);
        state.sheets.push_back(
            organ_in_contact(contacts[i], line,
                             contacts[i].share * setting.parameter("slide") * out, whole, relief));
    }
    // The line crosses the picture at a slant.
    place_camera(state,
                 {.roll = 24.0 * kDegree, .shift = {1.5 * std::sin(kTwoPi * time / 59.0), 1.0, 0}},
                 setting);
    return state;
}

// Fold: along s the tissue goes up, over a round top, down and on. Each leg turns by an angle in an
// arc at its top and back in an arc at its foot.

constexpr double kTopRadius = 3.5, kFootRadius = 3.0;  // mm

/// One side of a fold, from its top.
struct Leg {
    double angle = 0;   ///< rad, of its steepest part
    double length = 0;  ///< mm, of its straight part

    struct Place {
        double along, down, turned;  ///< mm, mm, rad
    };
    double on_top() const { return kTopRadius * angle; }
    double whole() const { return on_top() + length + kFootRadius * angle; }
    Place at(double from_top) const {
        const double top = std::clamp(from_top, 0.0, on_top()) / kTopRadius;
        const double straight = std::clamp(from_top - on_top(), 0.0, length);
        const double foot =
            std::clamp(from_top - on_top() - length, 0.0, kFootRadius * angle) / kFootRadius;
        const double on = std::max(from_top - whole(), 0.0);
        const double turned = top - foot;
        return {kTopRadius * std::sin(top) + straight * std::cos(angle) +
                    kFootRadius * (std::sin(angle) - std::sin(angle - foot)) + on,
                kTopRadius * (1.0 - std::cos(top)) + straight * std::sin(angle) +
                    kFootRadius * (std::cos(angle - foot) - std::cos(angle)),
                turned};
    }
    double height() const { return at(whole()).down; }
    /// mm by which tissue beyond the leg comes nearer.
    double drawn() const { return whole() - at(whole()).along; }
};

/// A fold whose legs meet the same plane and draw in the tissue from both sides alike.
struct Fold {
    Leg left, right;

    /// rise: 0..1. lean: rad to the right. height: mm of the straight legs before it leans.
    Fold(double rise, double lean, double height) {
        const double upright = 0.5 * std::numbers::pi;
        left = {rise * (upright - lean), height + (kTopRadius + kFootRadius) * std::tan(lean)};
        right.angle = rise * (upright + lean);
        if (rise > 0) {
            right.length = (left.height() - right.height()) / std::sin(right.angle);
        }
    }
    /// Along the plane, up, and the angle by which the tissue is turned.
    Eigen::Vector3d at(double s) const {
        const Leg::Place place = s < 0 ? left.at(-s) : right.at(s);
        const double top = 0.5 * (right.drawn() - left.drawn());
        return s < 0
                   ? Eigen::Vector3d(top - place.along, left.height() - place.down, place.turned)
                   : Eigen::Vector3d(top + place.along, left.height() - place.down, -place.turned);
    }
};

void lay_fold(const SceneParameters& /*parameters*/, Scene& scene) {
    constexpr double kSpacing = 0.4;  // mm, along the bends
    scene.textures = {{.look = scene.look, .seed = scene.seed}};
    scene.sheets = {whole_sheet(0, kSpacing)};
}

FrameState fold(const Setting& setting, double time) {
    constexpr double kBegins = 4, kRisen = 18, kLeans = 18, kLies = 28, kRises = 33, kUpright = 42,
                     kGone = 56, kPeriod = 60;
    FrameState state;
    state.time = time;
    state.motion.heartbeat = {
        .lift = 0.6, .shear = 0.6, .twist = 0.0, .period = 18, .wavelength = 90};
    const double since = std::fmod(time, kPeriod);
    const double rise = ease(kBegins, kRisen, since) * (1.0 - ease(kUpright, kGone, since));
    const double lean = setting.parameter("lean") * kDegree * ease(kLeans, kLies, since) *
                        (1.0 - ease(kRises, kUpright, since));
    const MeshFormula surface = surface_of(setting, state);
    state.sheets = {[=, height = setting.parameter("height"), depth = setting.depth](
                        double s, double t) -> Eigen::Vector3d {
        // A little lower on both sides of the middle.
        const Fold folded(rise * (0.92 + 0.08 * std::cos(kTwoPi * t / 80.0)), lean, height);
        const Eigen::Vector3d flat = surface(s, t), line = folded.at(flat.x());
        const double above = depth - flat.z();
        return {line.x() - std::sin(line.z()) * above, flat.y(),
                depth - line.y() - std::cos(line.z()) * above};
    }};
    place_camera(state,
                 {.pitch = 2.0 * kDegree * std::sin(kTwoPi * time / 60.0),
                  .roll = -15.0 * kDegree,
                  .shift = {1.5 * std::sin(kTwoPi * time / 55.0), 0, 0}},
                 setting);
    return state;
}

// Loops: two tubes side by side before a bed, of which the one climbs over the other. s runs along
// a tube, t round it.

constexpr double kTubeRadius = 11.0;            // mm
constexpr double kTubeBow = 2.5;                // mm to both sides
constexpr double kBedBehind = 15.0;             // mm behind the plane of the scene
constexpr double kTubeBehind = 6.0;             // mm, of a tube's axis
constexpr double kLargestTurn = 150 * kDegree;  // of a tube; its seam is half of that off the back
constexpr double kBesideSeam = 1.0;             // mm, without points

struct Tube {
    Eigen::Vector2d axis;  ///< y and z, mm
    double turned;         ///< rad about the axis
    double wave;           ///< phase of the peristalsis, rad
    double squeeze;        ///< of the radius

    Eigen::Vector3d at(double s, double t) const {
        const double angle = t / kTubeRadius + turned;
        const double radius = kTubeRadius * (1.0 + squeeze * std::sin(kTwoPi * s / 26.0 + wave));
        const double bow = kTubeBow * std::sin(s / 28.0 + 0.6);
        return {s, axis.x() + bow + radius * std::sin(angle), axis.y() - radius * std::cos(angle)};
    }
};

void lay_loops(const SceneParameters& /*parameters*/, Scene& scene) {
    const double half_round = std::numbers::pi * kTubeRadius;
    const double middle = -0.5 * kLargestTurn * kTubeRadius;
    Lattice tube = centred_lattice(kTissueHalfWidth, half_round, kTissueSpacing, half_round / 60);
    tube.first_t += middle;
    constexpr TissueLook kBowel{
        .mottling = 0.6f, .vessels = 1.0f, .spots = 0.4f, .base = {0.66f, 0.27f, 0.21f}};
    scene.textures = {{.look = kBowel, .seed = scene.seed},
                      {.look = kBowel, .seed = scramble(scene.seed ^ 1)},
                      {.look = kOrgan, .seed = scramble(scene.seed ^ 2)}};
    const auto on_tube = [=](const Eigen::Vector2d& m) {
        return std::abs(m.y() - middle) < half_round - kBesideSeam;
    };
    scene.sheets = {{.lattice = tube, .texture = 0, .has_points = on_tube},
                    {.lattice = tube, .texture = 1, .has_points = on_tube},
                    whole_sheet(2)};
}

FrameState loops(const Setting& setting, double time) {
    constexpr double kBegins = 4, kPeriod = 48;
    FrameState state;
    state.time = time;
    state.motion.heartbeat = {
        .lift = 1.5, .shear = 0.6, .twist = 0.0, .period = 18, .wavelength = 90};
    const double share = 0.5 - 0.5 * std::cos(kTwoPi * std::max(0.0, time - kBegins) / kPeriod);
    const double climbed = setting.parameter("climb") * kDegree * share;
    const double wave = -kTwoPi * time / 30.0, squeeze = setting.parameter("squeeze");
    // Where one is narrow the other is wide. Without slip each turns against the other; the tube
    // above goes round the tube below as well.
    const double below_turned = -0.5 * climbed;
    const Eigen::Vector2d below(kTubeRadius, setting.depth + kTubeBehind);
    const Eigen::Vector2d above =
        below - 2.0 * kTubeRadius * Eigen::Vector2d(std::cos(climbed), std::sin(climbed));
    const Tube tubes[] = {{below, below_turned, wave, squeeze},
                          {above, 2.0 * climbed - below_turned, wave + std::numbers::pi, squeeze}};
    for (const Tube& tube : tubes) {
        state.sheets.emplace_back([tube](double s, double t) { return tube.at(s, t); });
    }
    state.sheets.emplace_back(
        [bed = surface_of(setting, state)](double s, double t) -> Eigen::Vector3d {
            return bed(s, t) + Eigen::Vector3d(0, 0, kBedBehind);
        });
    place_camera(state,
                 {.roll = 12.0 * kDegree, .shift = {1.5 * std::sin(kTwoPi * time / 57.0), -1.0, 0}},
                 setting);
    return state;
}

}  // namespace

std::vector<Entry> sliding_entries() {
    return {
        {{.name = "shear",
          .summary = "organs slide along each other without a gap",
          .parameters = {{"slide", 14, 0, 20, "mm", "of an organ along its neighbour"},
                         {"curvature", 0, 0, 0.016, "1/mm", "of the line where they meet"},
                         {"step", 0, 0, 10, "mm", "of depth at the line"},
                         {"bodies", 2, 2, 3, "", "side by side"}}},
         kOrgan,
         0.5,
         0.68f,
         shear,
         lay_contacts},
        {{.name = "fold",
          .summary = "a fold rises from the tissue and lies down over it",
          .parameters = {{"height", 12, 11, 16, "mm", "of the fold's straight sides"},
                         {"lean", 52, 0, 54, "degrees", "from upright"}}},
         kOrgan,
         0.12,
         0.68f,
         fold,
         lay_fold,
         0,
         nullptr,
         0.2},
        {{.name = "loops",
          .summary = "a loop of bowel rolls over another",
          .parameters = {{"climb", 50, 0, 60, "degrees", "of the one about the other"},
                         {"squeeze", 0.05, 0, 0.1, "", "of the radius, in waves along the loops"}}},
         kOrgan,
         0.5,
         0.68f,
         loops,
         lay_loops},
    };
}

}  // namespace defrec::cli
