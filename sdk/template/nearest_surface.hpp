// Places beside a template's surface: how far away they are, and what they move with.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "sdk/template/nearest_nodes.hpp"
#include "sdk/template/template.hpp"

namespace defrec {

class NearestSurface {
  public:
    explicit NearestSurface(const TemplateData& data);

    struct Neighbours {
        NearestNodes anchor;
        size_t vertex = 0;  // about the nearest
        double distance_mm = 0;
    };
    // The control point nearest to a place in the template frame.
    size_t nearest_node(const Vec3<double>& place) const;
    // The neighbours of a place in the template frame.
    Neighbours beside(const TemplateData& data, const Vec3<double>& place) const;

  private:
    std::vector<Vec3<double>> nodes_;
    std::vector<uint32_t> first_, vertex_;  // per control point where its vertices begin; vertices
};

}  // namespace defrec
