// The tissue surface as a formula: material coordinates (s, t) in mm and time in frames to a point
// in mm. Motion is built from waves, swell, Gaussian indentation, pinch, pull, stretch, a cut and
// lobes, or is that of an elastic body; nothing of a tracker's own model.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "sdk/scenes/bodies/elastic_body.hpp"

namespace defrec::cli {

/// A beat that travels over the surface, with twist. Amplitudes in mm, period in frames.
struct Heartbeat {
    double lift = 0;         ///< towards the camera
    double shear = 0;        ///< along the direction of travel
    double twist = 0;        ///< rad, round the middle
    double period = 24;      ///< frames
    double wavelength = 70;  ///< mm
};

/// Breathing: the whole surface swells and shifts.
struct Respiration {
    double swell = 0;                                 ///< mm towards the camera, in the middle
    Eigen::Vector2d shift = Eigen::Vector2d::Zero();  ///< mm, whole surface
    double period = 48;                               ///< frames
};

/// What an instrument does to the surface; set anew for every frame.
struct Indentation {
    double depth = 0;                                  ///< mm away from the camera
    double sigma = 9;                                  ///< mm
    Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< material coordinates
    Eigen::Vector2d drag = Eigen::Vector2d::Zero();    ///< mm, tangential, where pressed
};

/// An instrument's tip that draws the tissue together under it while it presses; set anew for every
/// frame. In the plane, lengths at the centre shrink to 1 - gather.
struct Pinch {
    double depth = 0;                                  ///< mm away from the camera
    double sigma = 9;                                  ///< mm, of the pit
    double gather = 0;                                 ///< 0..0.5
    double gather_sigma = 10.2;                        ///< mm
    Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< material coordinates
    Eigen::Vector2d drag = Eigen::Vector2d::Zero();    ///< mm, tangential
};

/// Pull along s with contraction along t.
struct Stretch {
    double strain = 0;  ///< largest, in the middle; 0.35: 35 %
    double poisson = 0.4;
    double reach = 30;  ///< mm over which the strain fades
};

/// A place that is grasped and pulled: a tent with a rounded top; set anew for every frame.
struct Pull {
    Eigen::Vector3d by = Eigen::Vector3d::Zero();      ///< mm, of the top
    double reach = 5;                                  ///< mm over which the tent falls off
    Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< material coordinates
};

/// A cut along t = 0, |s| <= half_length, whose sides have moved apart and show a floor between
/// them.
struct Incision {
    double gap = 0;          ///< mm, where it is widest
    double half_length = 0;  ///< mm; 0: there is no cut
    double reach = 14;       ///< mm over which the sides are pushed together
    double floor = 7;        ///< mm below the sides, where it is deepest
};

/// Two lobes that meet at t = 0, the one below farther from the camera, and slide on each other. A
/// wall joins them.
struct Lobes {
    double step = 0;                                  ///< mm of depth between them
    double gap = 1;                                   ///< mm across the line, from rim to rim
    Eigen::Vector2d slide = Eigen::Vector2d::Zero();  ///< mm, of the lobe below
};

/// Sides of the line t = 0, which belongs to both sides of a cut, or both lobes.
enum class Side { above, below };  ///< t <= 0, t >= 0

struct Motion {
    Heartbeat heartbeat;
    Respiration respiration;
    Indentation indentation;
    Stretch stretch;
    Pinch pinch;
    Pull pull;
    Incision incision;
    Lobes lobes;
    std::optional<BodyMotion> body;  ///< replaces all others
};

class Surface {
  public:
    /// depth: mm, of the middle at rest. relief: scales the bumps, 1 is 1..2 mm each. curvature:
    /// 1/mm, along s, more than every surface has. bend: scales the tilt and the curvature that
    /// every surface has.
    Surface(double depth, double relief, std::uint64_t seed, double curvature = 0, double bend = 1);

    /// Point in the scene's frame, mm. The scene's frame is the left camera of a camera at rest.
    Eigen::Vector3d at(double s, double t, double time, const Motion& motion) const;

    /// The same for one side of a cut or one lobe, whose material goes on smoothly beyond the line.
    Eigen::Vector3d at(double s, double t, double time, const Motion& motion, Side side) const;

    /// Point at rest, `depth` mm beneath the surface.
    Eigen::Vector3d rest(double s, double t, double depth) const;

    /// Point of a body's material in a layer of kBodyDepths; the first is the surface.
    Eigen::Vector3d beneath(double s, double t, std::size_t layer, const BodyMotion& motion) const;

    /// Point of a cut's floor, which spans the gap from across = -1, above, to 1, below: a trough
    /// whose rims are the sides to the bit. For lobes: the wall between them.
    Eigen::Vector3d floor_at(double s, double across, double time, const Motion& motion) const;

  private:
    struct Wave {
        double ks, kt, phase, amplitude;
    };
    double rest_height(double s, double t) const;

    double depth_;
    double curvature_;
    double bend_;
    std::array<Wave, 7> bumps_;
    double beat_direction_;
    double beat_phase_;
};

}  // namespace defrec::cli
