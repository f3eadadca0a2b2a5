// Which tissue of a frame is not on the template's surface yet, and what is to move it.
#pragma once
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "sdk/template/capture.hpp"
#include "sdk/template/nearest_nodes.hpp"
#include "sdk/template/pixel_buckets.hpp"

namespace defrec {

// A frame in which the template was found.
struct FoundFrame {
    CaptureInput images;
    std::span<const defrec_motion> motions;  // per control point
};

// On a grid over the frame's image.
struct NewTissue {
    // A control point that may be added.
    struct Node {
        double u, v;  // px
        Vec3<double> place;
        NearestNodes anchor;
        DualQuaternion<double> motion, earlier_motion;
        uint8_t piece = 0;  // of the template's surface
    };

    double scale = 1;   // px for a px of the first view, for the same length on the surface
    TemplateData seen;  // the surface in the frame: sizes, camera and grid alone
    std::vector<Vec3<double>> vertex_at, node_at;  // the template there, mm
    std::optional<PixelBuckets> vertices;          // of the template, in the image
    std::vector<uint8_t> is_new;                   // per cell
    // The template's pieces that those of the surface in the frame continue; -1: none.
    std::vector<int> piece_of_seen;
    std::vector<Node> nodes;
    double node_spacing = 0;  // px

    size_t count() const {
        return static_cast<size_t>(std::count(is_new.begin(), is_new.end(), 1));
    }
    size_t columns() const { return static_cast<size_t>(seen.grid.columns); }
    size_t cells() const { return seen.grid.vertex.size(); }
    double cell_u(size_t cell) const {
        return std::min<double>(static_cast<double>(cell % columns()) * seen.grid.spacing,
                                seen.width - 1.0);
    }
    double cell_v(size_t cell) const {
        const size_t row = cell / columns();
        return std::min<double>(static_cast<double>(row) * seen.grid.spacing, seen.height - 1.0);
    }
    // The template's piece that a cell belongs to, where there is a surface; -1: none.
    int piece(size_t cell) const {
        const std::vector<uint8_t>& seen_piece = seen.grid.piece;
        return piece_of_seen[seen_piece.empty() ? 0 : size_t{seen_piece[cell]}];
    }
    // The template's nearest vertex at most that far from a cell, of its piece where the cell has a
    // surface; nullptr: none.
    const PixelPoint* nearest_vertex(const TemplateData& data, size_t cell, double distance) const {
        if (seen.grid.vertex[cell] < 0)
            return vertices->nearest(cell_u(cell), cell_v(cell), distance);
        const int wanted = piece(cell);
        return vertices->nearest(
            cell_u(cell), cell_v(cell), distance, [&](const PixelPoint& point) {
                return data.piece_of(data.vertices[static_cast<size_t>(point.index)]) == wanted;
            });
    }
    // The cell nearest to a pixel.
    size_t cell_at(double u, double v) const {
        const double s = seen.grid.spacing;
        const auto x =
            static_cast<size_t>(std::clamp<long>(std::lround(u / s), 0, seen.grid.columns - 1));
        const auto y =
            static_cast<size_t>(std::clamp<long>(std::lround(v / s), 0, seen.grid.rows - 1));
        return y * columns() + x;
    }
    Vec3<double> place_of(double u, double v, double disparity) const {
        const auto p = back_project(seen.camera, u, v, disparity);
        return {p[0], p[1], p[2]};
    }
    double pixel_u(const Vec3<double>& p) const {
        return seen.camera.fx * p.x / p.z + seen.camera.cx;
    }
    double pixel_v(const Vec3<double>& p) const {
        return seen.camera.fy * p.y / p.z + seen.camera.cy;
    }
};

// What was found of it.
enum class Search {
    kFound,
    kNothing,  // no tissue beside the surface that both frames show
    kUnfit     // what is seen now does not lie where the surface was found
};
Search find_new_tissue(const TemplateData& data, const FoundFrame& earlier, const FoundFrame& now,
                       NewTissue& tissue);

}  // namespace defrec
