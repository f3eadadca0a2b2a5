// The template: the surface of one frame with its control points, landmarks and patches, and the
// tissue that joined it later (growth.hpp). Immutable once made, shared between trackers.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "include/defrec_c.h"

namespace defrec {

class BodySlot;  // body_slot.hpp
struct BodySurface;
class Context;
class Services;
class SurfaceIndex;    // surface_index.hpp
class NearestSurface;  // nearest_surface.hpp
template <class T>
struct DualQuaternion;  // motion.hpp

// A point moves with up to DEFREC_BLEND_NODES control points with weights of sum 1.
struct BlendWeights {
    std::array<int32_t, DEFREC_BLEND_NODES> node{};
    std::array<float, DEFREC_BLEND_NODES> weight{};
};

// A regular grid over the template's image. Vertices, triangles and lifting all come from it.
struct SurfaceGrid {
    int columns = 0, rows = 0;
    double spacing = 0;            // px
    std::vector<float> disparity;  // px, smoothed, with the camera's offset; columns * rows; only
                                   // where vertex >= 0 it means something
    std::vector<float>
        support;  // px to the nearest pixel with measured disparity; 0: measured here
    std::vector<int32_t> vertex;  // index of the template's vertex, -1: no surface
    std::vector<uint8_t> piece;   // of the surface, where vertex >= 0; empty: there is one
};

// Where a piece of the surface came apart: a line in the template's image that no connection, no
// weight and no triangle crosses (cut.hpp).
struct CutLine {
    uint8_t piece = 0;
    std::vector<std::array<float, 2>> pixels;  // u and v; at least two
};

// Control points on regular grids over the template's image, one grid for each piece of the
// surface.
struct NodeGrid {
    int columns = 0, rows = 0;
    double spacing_u = 0, spacing_v = 0;  // px
    std::vector<int32_t> node;            // index of the control point, -1: none; piece by piece
    std::vector<CutLine> cuts;
    size_t cells() const { return static_cast<size_t>(columns) * static_cast<size_t>(rows); }
    bool has_piece(size_t piece) const { return (piece + 1) * cells() <= node.size(); }
};

// How many of each a template has.
struct TemplateCounts {
    uint64_t vertices = 0, triangles = 0, nodes = 0, edges = 0, landmarks = 0, patches = 0,
             checks = 0;
};

// Tissue that joined: a piece of a regular grid over the image of the frame that showed it.
struct SurfacePatch {
    int32_t columns = 0, rows = 0;
    float step_mm = 0;                           // between neighbours of the grid, on the surface
    float min_disparity = 0, max_disparity = 0;  // px, of the tissue in that frame
    std::vector<int32_t> vertex;  // index of the template's vertex: its own, those of earlier ones
                                  // round them; -1: none
    TemplateCounts before;        // of the template that it joined; its own follow
};

// The place of the next piece of an image in the last image of a template's atlas (atlas.hpp).
struct AtlasEnd {
    uint32_t x = 0, y = 0;  // px
    uint32_t shelf = 0;     // height of the row of pieces that begins at y
};

struct TemplateData {
    uint32_t width = 0, height = 0;
    defrec_camera camera{};
    SurfaceGrid grid;
    NodeGrid node_grid;
    double node_spacing_mm = 0;  // median distance between neighbouring control points
    // Standard deviation of the disparity that it was captured with where an application gave that;
    // 0: stage stereo measured it.
    float disparity_sigma_px = 0;
    std::vector<defrec_surface_point> vertices;
    std::vector<float> vertex_support;  // px to the nearest measured disparity, per vertex
    std::vector<uint32_t> triangles;
    std::vector<float> nodes;         // xyz
    std::vector<uint8_t> node_piece;  // of the surface, per control point; empty: there is one
    std::vector<defrec_edge> edges;
    std::vector<defrec_landmark> landmarks;
    std::vector<defrec_surface_point> landmark_points;
    std::vector<defrec_patch> patches;
    // The image of the first view, then the atlas of pieces of later ones; width * height each.
    std::vector<uint8_t> image;
    std::vector<SurfacePatch> parts;
    AtlasEnd atlas_end;
    // Made of the above, not in the file: texture_level() of the first view's image.
    uint32_t texture_level = 0;
    // Likewise: check_patches.hpp.
    std::vector<defrec_patch> checks;
    std::vector<int32_t> check_of_vertex;  // index of the check whose window it lies in, -1: none

    TemplateCounts counts() const;
    // Surfaces without a connection between them. What control points move belongs to theirs.
    size_t pieces() const;
    uint8_t piece_of_node(size_t node) const { return node_piece.empty() ? 0 : node_piece[node]; }
    template <class Item>
    uint8_t piece_of(const Item& item) const {
        return piece_of_node(static_cast<size_t>(item.node[0]));
    }
    // Counts of the first view.
    TemplateCounts first_counts() const { return parts.empty() ? counts() : parts.front().before; }
    bool is_faint() const;  // is_faint(texture_level)
    size_t views() const { return image.size() / (size_t{width} * height); }
};

// The control points that move a point of the template frame; the same in all frames.
struct PointAnchor {
    // The control points' weights; for tissue that joined, those of the corners' motions.
    BlendWeights weights;
    std::array<uint32_t, 3> corner{};  // vertices
    bool is_grown = false;
};

class Template {
  public:
    // services: whose background thread computes the body beneath it.
    explicit Template(TemplateData data, std::weak_ptr<const Services> services = {});
    // What before became by growing or by a cut: its body serves until this one's is ready.
    Template(TemplateData data, const Template& before);
    ~Template();

    const TemplateData& data() const { return data_; }

    void info(defrec_template_info& out) const;

    // Surface points under pixels (u, v) of the rectified left image: xyz in mm; found is 0 where
    // there is no surface.
    void lift(const double* uv, size_t count, double* xyz, uint8_t* found) const;
    // The piece of each point; 255 for one that is not finite.
    void point_pieces(const double* xyz, size_t count, uint8_t* pieces) const;

    // How a point of the template frame moves, on the surface or off it; motions: of the control
    // points.
    DualQuaternion<double> motion_at(const double xyz[3], const defrec_motion* motions) const;
    // The same in two steps.
    PointAnchor anchor_of(const double xyz[3]) const;
    DualQuaternion<double> motion_of(const PointAnchor& anchor, const defrec_motion* motions) const;
    // The piece of the surface that a point belongs to.
    uint8_t piece_at(const double xyz[3]) const;
    // The same of each vertex.
    std::span<const uint8_t> vertex_pieces() const { return vertex_pieces_; }
    // The vertex that a point belongs to: nearest to it on tissue that joined, or under its pixel
    // in the first view; -1: there is none within two steps of the grid.
    int32_t vertex_at(const double xyz[3]) const;
    const NearestSurface& nearest_surface() const { return *nearest_surface_; }

    // The body beneath it, as defrec_template_set_body and defrec_template_wait_body have it.
    void start_body() const;
    defrec_status wait_body(uint64_t timeout_ns) const;
    void set_body(const defrec_body_desc* desc) const;
    const BodySlot& body() const;
    // Whether this one became of that one by growing or by cuts, or is it.
    bool descends_from(const Template& other) const { return lineage_ == other.lineage_; }

    // The template as a file; throws Error(DEFREC_ERROR_IO).
    void save(const char* path) const;
    static std::shared_ptr<const Template> load(Context& context, const char* path);

  private:
    Template(TemplateData data, std::shared_ptr<BodySlot> body, std::shared_ptr<const int> lineage);
    BodySurface body_surface() const;
    // On tissue that joined; -1: it is not.
    int32_t grown_vertex(const double xyz[3]) const;
    BlendWeights blend_weights_of(const double xyz[3]) const;

    TemplateData data_;
    std::vector<defrec_cut_point> cut_points_;
    std::vector<uint8_t> vertex_pieces_;
    std::unique_ptr<const SurfaceIndex> index_;  // null: it has not grown
    std::unique_ptr<const NearestSurface> nearest_surface_;
    std::shared_ptr<BodySlot> body_;
    std::shared_ptr<const int> lineage_;
};

// The piece of the grid's surface at a pixel, to which most of the vertices round it belong; -1:
// outside the surface.
int grid_piece(const TemplateData& data, double u, double v);
// Disparity of the grid at a pixel, by bilinear interpolation over the vertices of a piece round
// it, or of the piece that lies there; false outside.
bool grid_disparity(const TemplateData& data, int piece, double u, double v, double& disparity,
                    double& support);
bool grid_disparity(const TemplateData& data, double u, double v, double& disparity,
                    double& support);
// The control points of a piece round a pixel, bilinear; beside a cut those on the pixel's side.
// false where there are none.
bool grid_blend_weights(const NodeGrid& grid, size_t piece, double u, double v,
                        BlendWeights& blend_weights);
// How the weights there change per pixel; 0 where one of the four control points is missing or lies
// beyond a cut.
defrec_patch_slope grid_slope(const NodeGrid& grid, size_t piece, double u, double v);
// The point at (u, v) with that disparity.
std::array<double, 3> back_project(const defrec_camera& camera, double u, double v,
                                   double disparity);

}  // namespace defrec
