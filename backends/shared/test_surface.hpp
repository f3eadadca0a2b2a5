// A surface that deforms by a given function, as tests and benchmarks of lm and warp see it:
// template, control points, and the disparity image, matches and patch observations of the deformed
// surface. Exact but for the rounding of disparities to 1/16 px.
#pragma once
#include <algorithm>
#include <functional>
#include <random>
#include <vector>

#include "backends/shared/live_depth.hpp"

namespace defrec::test {

struct SurfaceSpec {
    uint32_t width = 240, height = 136;  // px
    double focal = 250, baseline = 4.6, depth = 80;
    double node_step = 20, point_step = 4;  // px
    uint32_t landmarks = 200, patches = 120;
    double connection = 2.5;  // node steps over which control points are connected
};

using Deformation = std::function<Vec3<double>(Vec3<double>)>;

class TestSurface {
  public:
    explicit TestSurface(const SurfaceSpec& spec) : spec_(spec) {
        camera = {spec.focal,    spec.focal, (spec.width - 1) / 2.0, (spec.height - 1) / 2.0,
                  spec.baseline, 0};
        columns_ = int(std::ceil((spec.width - 1) / spec.node_step)) + 1;
        rows_ = int(std::ceil((spec.height - 1) / spec.node_step)) + 1;
        spacing_mm = float(spec.node_step * spec.depth / spec.focal);
        for (int y = 0; y < rows_; ++y)
            for (int x = 0; x < columns_; ++x)
                push(nodes, lift(x * spec.node_step, y * spec.node_step));
        connect();
        for (double v = 0; v <= spec.height - 1; v += spec.point_step)
            for (double u = 0; u <= spec.width - 1; u += spec.point_step)
                points.push_back(surface_point(u, v));
        std::mt19937 random(7);
        std::uniform_real_distribution<double> across(4, spec.width - 5), down(4, spec.height - 5);
        for (uint32_t i = 0; i < spec.landmarks; ++i)
            landmarks.push_back(surface_point(across(random), down(random)));
        for (uint32_t i = 0; i < spec.patches; ++i) {
            const defrec_surface_point point = surface_point(across(random), down(random));
            defrec_patch patch{};
            std::copy(point.position, point.position + 3, patch.position);
            std::copy(point.node, point.node + DEFREC_BLEND_NODES, patch.node);
            std::copy(point.weight, point.weight + DEFREC_BLEND_NODES, patch.weight);
            patches.push_back(patch);
        }
    }

    // The live image of the surface moved by deformation.
    void deform(const Deformation& deformation) {
        matches.clear();
        for (const auto& landmark : landmarks) {
            defrec_match match{};
            store3(deformation(load3<double>(landmark.position)), match.position);
            match.weight = 1;
            matches.push_back(match);
        }
        observations.clear();
        for (const auto& patch : patches) {
            const auto pixel = project(deformation(load3<double>(patch.position)));
            observations.push_back({int32_t(std::lround(pixel.u * kPatchOne)),
                                    int32_t(std::lround(pixel.v * kPatchOne)),
                                    kScoreOne,
                                    1,
                                    {1, 0, 1},
                                    0});
        }
        render(deformation);
    }

    // Takes everything away that is seen where hidden(u, v) of the live image.
    void hide(const std::function<bool(double, double)>& hidden) {
        for (auto& match : matches) {
            const auto pixel = project(load3<double>(match.position));
            if (hidden(pixel.u, pixel.v)) match = {};
        }
        for (auto& seen : observations)
            if (hidden(double(seen.u) / kPatchOne, double(seen.v) / kPatchOne)) seen.valid = 0;
        for (uint32_t y = 0; y < spec_.height; ++y)
            for (uint32_t x = 0; x < spec_.width; ++x)
                if (hidden(x, y)) disparity[y * spec_.width + x] = DEFREC_DISPARITY_NONE;
    }

    double width() const { return spec_.width; }
    double height() const { return spec_.height; }
    std::vector<defrec_motion> rest() const {
        return std::vector<defrec_motion>(nodes.size() / 3,
                                          DualQuaternion<double>::identity().store());
    }
    // Where motions take a point of the template.
    static Vec3<double> moved(const std::vector<defrec_motion>& motions,
                              const defrec_surface_point& point) {
        return apply(blend<double>(motions.data(), point.node, point.weight),
                     load3<double>(point.position));
    }
    Pixel<double> project(Vec3<double> p) const {
        return {camera.fx * p.x / p.z + camera.cx, camera.fy * p.y / p.z + camera.cy};
    }

    defrec_lm_params lm_params() const {
        defrec_lm_params params{};
        params.struct_size = sizeof params;
        params.nodes = uint32_t(nodes.size() / 3);
        params.edges = uint32_t(edges.size());
        params.points = uint32_t(points.size());
        params.landmarks = uint32_t(landmarks.size());
        params.patches = uint32_t(patches.size());
        params.width = spec_.width;
        params.height = spec_.height;
        params.camera = camera;
        params.node_spacing_mm = spacing_mm;
        return params;
    }

    defrec_camera camera;
    float spacing_mm;
    std::vector<float> nodes;
    std::vector<defrec_edge> edges;
    std::vector<defrec_surface_point> points, landmarks;
    std::vector<defrec_patch> patches;
    std::vector<defrec_match> matches;
    std::vector<defrec_patch_observation> observations;
    std::vector<int16_t> disparity;

  private:
    static void push(std::vector<float>& out, Vec3<double> p) {
        for (const double value : {p.x, p.y, p.z}) out.push_back(float(value));
    }
    double height_at(double x, double y) const {
        return spec_.depth + 3 * std::sin(x / 11) * std::cos(y / 9) + 0.05 * x;
    }
    // The point of the template seen at a pixel.
    Vec3<double> lift(double u, double v) const {
        const double x = (u - camera.cx) / camera.fx, y = (v - camera.cy) / camera.fy;
        double z = spec_.depth;
        for (int i = 0; i < 60; ++i) z = height_at(x * z, y * z);
        return {x * z, y * z, z};
    }
    Vec3<double> normal_at(Vec3<double> p) const {
        constexpr double kStep = 1e-4;
        const double zx = (height_at(p.x + kStep, p.y) - height_at(p.x - kStep, p.y)) / (2 * kStep);
        const double zy = (height_at(p.x, p.y + kStep) - height_at(p.x, p.y - kStep)) / (2 * kStep);
        const Vec3<double> n{zx, zy, -1};
        return (1 / std::sqrt(dot(n, n))) * n;
    }
    defrec_surface_point surface_point(double u, double v) const {
        const Vec3<double> position = lift(u, v);
        defrec_surface_point point{};
        store3(position, point.position);
        store3(normal_at(position), point.normal);
        const double x = u / spec_.node_step, y = v / spec_.node_step;
        const int x0 = std::min(int(x), columns_ - 2), y0 = std::min(int(y), rows_ - 2);
        for (int k = 0; k < DEFREC_BLEND_NODES; ++k) {
            const int dx = k % 2, dy = k / 2;
            point.node[k] = (y0 + dy) * columns_ + x0 + dx;
            point.weight[k] = float((dx ? x - x0 : 1 - (x - x0)) * (dy ? y - y0 : 1 - (y - y0)));
        }
        return point;
    }
    void connect() {
        const int count = columns_ * rows_;
        for (int a = 0; a < count; ++a)
            for (int b = a + 1; b < count; ++b) {
                const Vec3<double> along =
                    load3<double>(&nodes[size_t(b) * 3]) - load3<double>(&nodes[size_t(a) * 3]);
                const double d = std::sqrt(dot(along, along)) / spacing_mm;
                if (d <= spec_.connection)
                    edges.push_back({a, b, float(std::exp(-0.5 * (d / 1.5) * (d / 1.5)))});
            }
    }
    // Newton's method for the point of the template that is seen at each pixel, row by row from its
    // neighbour's.
    void render(const Deformation& deformation) {
        disparity.assign(size_t(spec_.width) * spec_.height, int16_t(DEFREC_DISPARITY_NONE));
        for (uint32_t y = 0; y < spec_.height; ++y) {
            Vec3<double> at = lift(0, y);
            for (uint32_t x = 0; x < spec_.width; ++x) {
                const auto moved_at = [&](double px, double py) {
                    return deformation({px, py, height_at(px, py)});
                };
                Vec3<double> p = moved_at(at.x, at.y);
                for (int i = 0; i < 8; ++i) {
                    constexpr double kStep = 1e-4;
                    const auto o = project(p), a = project(moved_at(at.x + kStep, at.y)),
                               b = project(moved_at(at.x, at.y + kStep));
                    const double eu = x - o.u, ev = y - o.v;
                    const double au = (a.u - o.u) / kStep, av = (a.v - o.v) / kStep,
                                 bu = (b.u - o.u) / kStep, bv = (b.v - o.v) / kStep;
                    const double det = au * bv - av * bu;
                    at.x += (eu * bv - ev * bu) / det;
                    at.y += (au * ev - av * eu) / det;
                    p = moved_at(at.x, at.y);
                    if (std::abs(eu) + std::abs(ev) < 1e-4) break;
                }
                disparity[y * spec_.width + x] =
                    int16_t(std::lround(kDisparityOne * camera.fx * camera.baseline_mm / p.z));
            }
        }
    }

    SurfaceSpec spec_;
    int columns_ = 0, rows_ = 0;
};

// Names the control points of items in several orders.
inline void reorder_control_points(TestSurface& surface) {
    const auto reorder = [](auto& items) {
        for (size_t i = 0; i < items.size(); ++i) {
            std::rotate(items[i].node, items[i].node + i % 4, items[i].node + DEFREC_BLEND_NODES);
            std::rotate(items[i].weight, items[i].weight + i % 4,
                        items[i].weight + DEFREC_BLEND_NODES);
        }
    };
    reorder(surface.points);
    reorder(surface.landmarks);
    reorder(surface.patches);
}

// Motions that turn control points where they are, by 0, 120 or 240 degrees: which of them comes
// first decides what lies between them.
inline std::vector<defrec_motion> turned_apart(const TestSurface& surface) {
    std::vector<defrec_motion> motions;
    for (size_t i = 0; i < surface.nodes.size() / 3; ++i) {
        const Vec3<double> node = load3<double>(&surface.nodes[3 * i]);
        const auto turn = rotation_from_vector(Vec3<double>{0.02, 0.01, 2.0943951 * double(i % 3)});
        motions.push_back(from_rigid(turn, node - rotate(turn, node)).store());
    }
    return motions;
}

}  // namespace defrec::test
