// Finds the vertices of a grown template near a point of the template frame. A template that has
// not grown needs none: there, pixels of its image tell.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "backends/shared/motion.hpp"
#include "sdk/template/template.hpp"

namespace defrec {

class SurfaceIndex {
  public:
    explicit SurfaceIndex(const TemplateData& data);

    // The nearest vertex within about two steps of the surface's grid; -1: there is none.
    int32_t nearest_vertex(const TemplateData& data, const double xyz[3]) const;

    // How a point by that vertex moves: as the nearest point of the vertex's triangles, whose
    // corners' motions are blended with barycentric weights.
    PointAnchor anchor_of(const TemplateData& data, int32_t vertex, const double xyz[3]) const;

  private:
    struct Entry {
        int64_t cell;
        int32_t vertex;
    };
    int64_t cell_of(const double xyz[3]) const;

    double side_ = 1;                         // of a cell, mm
    std::vector<Entry> sorted_;               // by cell
    std::vector<uint32_t> first_, triangle_;  // per vertex where its triangles begin; triangles
};

}  // namespace defrec
