// Which point of the deformed surface each pixel of a view sees: a fine mesh of the surface, hit
// by the exact ray of every pixel, so that lens distortion costs no accuracy.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "sdk/scenes/instrument.hpp"
#include "sdk/scenes/rig.hpp"

namespace defrec::cli {

/// One view: its lens, the ray of every pixel, and its pose for the frame.
struct View {
    Lens lens;
    int width = 0, height = 0;
    std::vector<Eigen::Vector2f> rays;        ///< (x/z, y/z), width * height
    Eigen::Vector2f lowest_ray, highest_ray;  ///< bounds of rays
    Eigen::Matrix3d rotation =
        Eigen::Matrix3d::Identity();  ///< x_view = rotation * x_scene + translation
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();

    View(const Lens& its_lens, int its_width, int its_height, int threads);
    Eigen::Vector3d from_scene(const Eigen::Vector3d& point) const {
        return rotation * point + translation;
    }
    Instrument from_scene(Instrument instrument) const {
        instrument.tip = from_scene(instrument.tip);
        instrument.axis = rotation * instrument.axis;
        return instrument;
    }
};

/// From the coordinates of a mesh to a point in the scene's frame, mm.
using MeshFormula = std::function<Eigen::Vector3d(double s, double t)>;

/// The vertices of a regular mesh, in material coordinates.
struct Lattice {
    int columns = 0, rows = 0;
    double spacing_s = 0, spacing_t = 0, first_s = 0, first_t = 0;  ///< mm
};

/// Has its middle at (0, 0) and covers at least the half width and the half height.
Lattice centred_lattice(double half_width, double half_height, double spacing_s, double spacing_t);

/// Columns and rows of a lattice, inclusive; may be empty.
struct LatticeWindow {
    int first_column = 0, last_column = -1, first_row = 0, last_row = -1;
};

/// A regular mesh in material coordinates, deformed for one frame. Scene's frame, mm. Only the
/// vertices inside the window, which holds all that the views see, are of the frame.
struct DeformedMesh : Lattice {
    int first_drawn = 0, last_drawn = 0;   ///< rows; those next to them serve the normals
    LatticeWindow hole;                    ///< cells between these vertices are not drawn
    std::vector<Eigen::Vector3d> points;   ///< columns * rows
    std::vector<Eigen::Vector3f> normals;  ///< unit, towards the camera
    LatticeWindow window;

    explicit DeformedMesh(const Lattice& lattice);
    void deform(const MeshFormula& at, const std::vector<const View*>& views, int threads);

  private:
    LatticeWindow seen_window(const MeshFormula& at, const std::vector<const View*>& views) const;
};

/// What a pixel sees of the mesh; z is 0 where it sees none.
struct Hit {
    float z = 0;             ///< mm along the optical axis
    float s = 0, t = 0;      ///< material
    std::uint8_t mesh = 0;   ///< number of the mesh among those rendered
    Eigen::Vector3f normal;  ///< scene's frame, not normalised
};

/// Holds the buffers of one size between frames.
class MeshRaster {
  public:
    /// hits: width * height. Same result for any number of threads.
    void render(const std::vector<DeformedMesh>& meshes, const View& view, int threads,
                std::vector<Hit>& hits);

  private:
    void project(const DeformedMesh& mesh, const View& view, int threads);
    struct Seen {
        Eigen::Vector3d point;  ///< view's frame
        float u, v;
    };
    /// A mesh, and its number among those rendered.
    struct Numbered {
        const DeformedMesh& mesh;
        std::uint8_t number;
    };
    void band(const Numbered& numbered, const View& view, int first, int last,
              std::vector<Hit>& hits) const;
    void triangle(const Numbered& numbered, const View& view, const int (&corner)[3], int first,
                  int last, std::vector<Hit>& hits) const;

    std::vector<Seen> seen_;
};

}  // namespace defrec::cli
