// The scenes in which a piece of the tissue comes off what lies beneath it.
#include "sdk/scenes/piece_scenes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "sdk/scenes/noise.hpp"

namespace defrec::cli {
namespace {

constexpr double kThickness = 2.0;  // mm, of the piece
constexpr double kBedDepth = 2.4;   // mm beneath the surface
constexpr double kRoundEdge = 1.2;  // mm over which thickness and depth begin at the edge
constexpr double kBesideCut = 0.5;  // mm, without points
constexpr std::size_t kUnderside = 1, kBed = 2;  // textures
enum PieceSheet : std::size_t { kOuter, kUpper, kUnder, kBottom, kPieceSheets };

/// A rectangle of tissue whose edge s = first_s is the hinge, where it has one.
struct Piece {
    double length = 0, width = 0;  ///< mm, along s and t

    double first_s() const { return -0.5 * length + 2.0; }
    double last_s() const { return first_s() + length; }

    /// mm to the nearest edge; negative outside.
    double inside(const Eigen::Vector2d& material) const {
        return std::min({material.x() - first_s(), last_s() - material.x(),
                         0.5 * width - std::abs(material.y())});
    }
    /// 1 in the middle, 0 on the edges to the bit.
    double thickness_at(double s, double t) const {
        const auto round = [](double distance) {
            const double x = 1.0 - std::clamp(distance / kRoundEdge, 0.0, 1.0);
            return 1.0 - x * x;
        };
        return round(s - first_s()) * round(last_s() - s) * round(0.5 * width - std::abs(t));
    }
};

Piece piece_of(const SceneParameters& parameters) {
    return {parameters.at("length"), parameters.at("width")};
}

/// The surroundings with a hole, the piece's sides, and what lies beneath, on one lattice: the
/// vertices of their common edges are the same.
void lay_piece(const SceneParameters& parameters, Scene& scene) {
    const Piece piece = piece_of(parameters);
    const int columns = static_cast<int>(std::lround(piece.length / kTissueSpacing));
    const int rows = static_cast<int>(std::lround(piece.width / kTissueSpacing));
    Lattice own{columns + 1,        rows + 1,        piece.length / columns,
                piece.width / rows, piece.first_s(), -0.5 * piece.width};
    const int before =
        static_cast<int>(std::ceil((kTissueHalfWidth + own.first_s) / own.spacing_s));
    const int above =
        static_cast<int>(std::ceil((kTissueHalfHeight + own.first_t) / own.spacing_t));
    const int after =
        static_cast<int>(std::ceil((kTissueHalfWidth - piece.last_s()) / own.spacing_s));
    Lattice outer = own;
    outer.columns += before + after;
    outer.rows += 2 * above;
    outer.first_s -= before * own.spacing_s;
    outer.first_t -= above * own.spacing_t;
    Lattice mirrored = own;
    mirrored.first_s = -piece.last_s();

    scene.textures = {{.look = scene.look, .seed = scene.seed},
                      {.look = {.mottling = 0.5f,
                                .vessels = 0.5f,
                                .spots = 0.3f,
                                .gloss = 0.7f,
                                .base = {0.64f, 0.33f, 0.27f}},
                       .half_width = 40,
                       .half_height = 30,
                       .seed = scramble(scene.seed ^ 0xF1A9)},
                      {.look = {.mottling = 0.7f,
                                .vessels = 0.5f,
                                .spots = 0.8f,
                                .gloss = 0.8f,
                                .base = {0.34f, 0.050f, 0.038f}},
                       .half_width = 40,
                       .half_height = 30,
                       .seed = ~scene.seed}};
    scene.sheets.resize(kPieceSheets);
    scene.sheets[kOuter] = {
        .lattice = outer,
        .hole = {before, before + columns, above, above + rows},
        .has_points = [piece](const Eigen::Vector2d& m) { return piece.inside(m) < -kBesideCut; }};
    scene.sheets[kUpper] = {.lattice = own, .has_points = [piece](const Eigen::Vector2d& m) {
                                return piece.inside(m) > kBesideCut;
                            }};
    scene.sheets[kUnder] = {.lattice = mirrored, .texture = kUnderside};
    scene.sheets[kBottom] = {.lattice = own, .texture = kBed};
}

/// The formulas of the sheets, from that of the whole surface and of the piece's upper side and the
/// direction from there into the piece.
std::vector<MeshFormula> sheets_of(const Piece& piece, const MeshFormula& surface,
                                   const MeshFormula& upper, const MeshFormula& inwards) {
    std::vector<MeshFormula> sheets(kPieceSheets);
    sheets[kOuter] = surface;
    sheets[kUpper] = upper;
    sheets[kUnder] = [=](double mirrored, double t) -> Eigen::Vector3d {
        const double s = -mirrored;
        return upper(s, t) + kThickness * piece.thickness_at(s, t) * inwards(s, t);
    };
    sheets[kBottom] = [=](double s, double t) -> Eigen::Vector3d {
        return surface(s, t) + Eigen::Vector3d(0, 0, kBedDepth * piece.thickness_at(s, t));
    };
    return sheets;
}

/// Axes on the piece as it lies: from the hinge along the piece, along the hinge, and towards the
/// camera.
struct PieceFrame {
    Eigen::Vector3d origin, along, across, up;

    PieceFrame(const Piece& piece, const MeshFormula& surface)
        : origin(surface(piece.first_s(), 0)) {
        along = (surface(piece.last_s(), 0) - origin).normalized();
        across = surface(piece.first_s(), 0.5 * piece.width) -
                 surface(piece.first_s(), -0.5 * piece.width);
        across = (across - across.dot(along) * along).normalized();
        up = across.cross(along);
    }
    Eigen::Vector3d local(const Eigen::Vector3d& point) const {
        const Eigen::Vector3d p = point - origin;
        return {p.dot(along), p.dot(across), p.dot(up)};
    }
};

/// A line that leaves the hinge, bends in an arc and goes on straight; lengths along it are kept.
struct Bend {
    double angle = 0;   ///< rad
    double radius = 6;  ///< mm, of the arc

    double turn(double length) const { return std::clamp(length / radius, 0.0, angle); }
    /// Along the piece as it lay, and up.
    Eigen::Vector2d at(double length) const {
        const double turned = turn(length), straight = length - radius * turned;
        return {radius * std::sin(turned) + straight * std::cos(turned),
                radius * (1.0 - std::cos(turned)) + straight * std::sin(turned)};
    }
};

/// The piece, bent upwards about its hinge. Where it is lifted it has the relief that it has at
/// rest; at the hinge it moves with the tissue there.
struct BentPiece {
    Piece piece;
    Bend bend;
    PieceFrame now, rest;
    double stiffness;  ///< 0..1: share of the relief at rest far from the hinge
    MeshFormula surface, surface_at_rest;

    Eigen::Vector3d upper(double s, double t) const {
        constexpr double kReach = 10.0;  // mm from the hinge
        const double length = s - piece.first_s();
        const double share = stiffness * ease(0.0, kReach, length);
        const Eigen::Vector3d local =
            (1.0 - share) * now.local(surface(s, t)) + share * rest.local(surface_at_rest(s, t));
        const Eigen::Vector2d line = bend.at(length);
        const double turned = bend.turn(length);
        const Eigen::Vector3d tangent = std::cos(turned) * now.along + std::sin(turned) * now.up;
        return now.origin + line.x() * now.along + line.y() * now.up + local.y() * now.across +
               (local.x() - length) * tangent - local.z() * inwards(s);
    }
    Eigen::Vector3d inwards(double s) const {
        const double turned = bend.turn(s - piece.first_s());
        return std::sin(turned) * now.along - std::cos(turned) * now.up;
    }
};

/// An instrument that comes with the event, holds a place of the tissue and leaves.
Instrument holding(const Eigen::Vector3d& place, double there) {
    Instrument tool;
    tool.axis = Eigen::Vector3d(0.62, 0.52, -0.59).normalized();
    tool.tip = place + 45.0 * (1.0 - there) * tool.axis;
    return tool;
}

/// A frame with a beat, before a camera that sways; its surface, with the piece in it, and that at
/// rest.
struct Beating {
    FrameState state;
    MeshFormula surface, at_rest;

    Beating(const Setting& setting, double time) {
        state.time = time;
        state.motion.heartbeat = {
            .lift = 2.0, .shear = 0.8, .twist = 0.0, .period = 18, .wavelength = 90};
        surface = surface_of(setting, state);
        at_rest = [whole = *setting.surface](double s, double t) { return whole.rest(s, t, 0); };
        place_camera(state,
                     {.yaw = 2.0 * kDegree * std::sin(kTwoPi * time / 60.0),
                      .roll = 8.0 * kDegree,
                      .shift = {1.5 * std::sin(kTwoPi * time / 55.0), 0, 0}},
                     setting);
    }
};

FrameState flap(const Setting& setting, double time) {
    constexpr double kArrives = 4, kLifted = 18, kLowers = 22, kLaidBack = 36, kPeriod = 40;
    auto [state, surface, at_rest] = Beating(setting, time);
    const double since = std::fmod(time, kPeriod);
    const double lifted = ease(kArrives, kLifted, since) * (1.0 - ease(kLowers, kLaidBack, since));
    const Piece piece = piece_of(*setting.parameters);
    const BentPiece bent{.piece = piece,
                         .bend = {.angle = setting.parameter("angle") * kDegree * lifted,
                                  .radius = setting.parameter("radius")},
                         .now = PieceFrame(piece, surface),
                         .rest = PieceFrame(piece, at_rest),
                         .stiffness = ease(0.0, 0.3, lifted),
                         .surface = surface,
                         .surface_at_rest = at_rest};
    state.sheets = sheets_of(
        piece, surface, [bent](double s, double t) { return bent.upper(s, t); },
        [bent](double s, double) { return bent.inwards(s); });
    if (setting.parameter("instrument") != 0) {
        const double there = ease(0.0, kArrives, since) * (1.0 - ease(kLaidBack, kPeriod, since));
        state.instruments.push_back(holding(bent.upper(piece.last_s() - 1.0, 0), there));
    }
    return state;
}

FrameState resection(const Setting& setting, double time) {
    constexpr double kArrives = 5, kTaken = 9, kLifted = 20, kLeaves = 15, kGone = 32;
    constexpr double kLift = 24, kAway = 90;  // mm
    auto [state, surface, at_rest] = Beating(setting, time);
    const Piece piece = piece_of(*setting.parameters);
    const PieceFrame now(piece, surface), rest(piece, at_rest);
    const double lifted = ease(kTaken, kLifted, time);
    const Eigen::Matrix3d turn =
        (Eigen::AngleAxisd(-35.0 * kDegree * lifted, now.across) *
         Eigen::AngleAxisd(40.0 * kDegree * ease(kLeaves, kGone, time), now.up))
            .toRotationMatrix();
    const Eigen::Vector3d middle(0.5 * piece.length, 0, 0);
    const Eigen::Vector3d moved =
        kLift * lifted * now.up +
        kAway * ease(kLeaves, kGone, time) * (0.8 * now.along + 0.6 * now.across);
    const MeshFormula upper = [=, surface = surface, at_rest = at_rest,
                               stiffness = ease(0.0, 0.3, lifted)](double s, double t) {
        const Eigen::Vector3d local = (1.0 - stiffness) * now.local(surface(s, t)) +
                                      stiffness * rest.local(at_rest(s, t)) - middle;
        const Eigen::Vector3d place =
            local.x() * now.along + local.y() * now.across + local.z() * now.up;
        return Eigen::Vector3d(now.origin + middle.x() * now.along + moved + turn * place);
    };
    const Eigen::Vector3d inwards = -(turn * now.up);
    state.sheets = sheets_of(piece, surface, upper, [inwards](double, double) { return inwards; });
    if (setting.parameter("instrument") != 0) {
        state.instruments.push_back(
            holding(upper(piece.first_s() + middle.x(), 0), ease(0.0, kArrives, time)));
    }
    return state;
}

}  // namespace

std::vector<Entry> piece_entries() {
    return {
        {{.name = "flap",
          .summary = "a piece of tissue is lifted on a hinge, turned over and laid back",
          .parameters = {{"angle", 105, 0, 150, "degrees", "by which the piece is turned"},
                         {"length", 32, 16, 36, "mm", "of the piece, from its hinge"},
                         {"width", 24, 8, 30, "mm", "of the piece, along its hinge"},
                         {"radius", 6, 3, 10, "mm", "of the bend at the hinge"},
                         {"instrument", 1, 0, 1, "", "0: none holds the piece"}}},
         kOrgan,
         0.3,
         0.68f,
         flap,
         lay_piece},
        {{.name = "resection",
          .summary = "a piece of tissue is cut out and carried away",
          .parameters = {{"length", 22, 16, 36, "mm", "of the piece"},
                         {"width", 18, 8, 30, "mm", "of the piece"},
                         {"instrument", 1, 0, 1, "", "0: none holds the piece"}}},
         kOrgan,
         0.3,
         0.68f,
         resection,
         lay_piece},
    };
}

}  // namespace defrec::cli
