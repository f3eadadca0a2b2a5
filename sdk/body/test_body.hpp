// Surfaces at rest and in a frame, and meshes, for tests of the body beneath.
#pragma once
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "sdk/body/body.hpp"
#include "sdk/body/body_motion.hpp"

namespace defrec::test {

// Tissue that a camera looks at along z.
struct TestSurface {
    std::vector<defrec_surface_point> vertices;
    std::vector<uint8_t> piece;
    size_t pieces = 1;
    std::vector<defrec_cut_point> cuts;

    BodySurface view() const { return {vertices, piece, pieces, cuts}; }
    Eigen::Vector3d position(size_t i) const {
        return Eigen::Map<const Eigen::Vector3f>(vertices[i].position).cast<double>();
    }
    void add(const Eigen::Vector3d& place, const Eigen::Vector3d& normal, uint8_t of_piece = 0) {
        defrec_surface_point vertex{};
        Eigen::Map<Eigen::Vector3f>(vertex.position) = place.cast<float>();
        Eigen::Map<Eigen::Vector3f>(vertex.normal) = normal.normalized().cast<float>();
        vertices.push_back(vertex);
        piece.push_back(of_piece);
        pieces = std::max<size_t>(pieces, of_piece + size_t{1});
    }
    // A line of points, as a template has them.
    void cut(const Eigen::Vector3d& from, const Eigen::Vector3d& to, uint32_t number = 0) {
        constexpr int kPoints = 20;
        for (int i = 0; i <= kPoints; ++i) {
            defrec_cut_point point{};
            Eigen::Map<Eigen::Vector3f>(point.position) =
                (from + (to - from) * i / kPoints).cast<float>();
            point.cut = number;
            cuts.push_back(point);
        }
    }
};

inline constexpr double kSurfaceZ = 100, kSurfaceWidth = 72, kSurfaceHeight = 52;

// z = kSurfaceZ + bow * (x^2 + y^2) round the z axis.
inline TestSurface make_surface(double bow = 0, double spacing = 2, double width = kSurfaceWidth,
                                double height = kSurfaceHeight) {
    TestSurface surface;
    for (double y = -height / 2; y <= height / 2 + 1e-9; y += spacing)
        for (double x = -width / 2; x <= width / 2 + 1e-9; x += spacing)
            surface.add({x, y, kSurfaceZ + bow * (x * x + y * y)}, {2 * bow * x, 2 * bow * y, -1});
    return surface;
}

// A frame of a surface: each vertex where `place` has it, with an error that is small.
struct MovedSurface {
    using Place = std::function<Eigen::Vector3d(const Eigen::Vector3d& rest, size_t vertex)>;
    std::vector<float> positions, errors;

    MovedSurface(const TestSurface& surface, const Place& place)
        : errors(surface.vertices.size(), 0.05f) {
        for (size_t i = 0; i < surface.vertices.size(); ++i)
            for (const double value : place(surface.position(i), i))
                positions.push_back(static_cast<float>(value));
    }
    SurfaceNow view() const { return {positions, errors}; }
};

inline std::shared_ptr<const Body> make_body(const TestSurface& surface,
                                             const BodyDescription& description = {}) {
    return Body::make(surface.view(), description, [] { return true; });
}

inline BodyMotion::Moved moved_by(const BodyMotion& motion, const Eigen::Vector3d& place,
                                  uint8_t piece = 0) {
    return motion.move(motion.body().find(place, piece), place);
}

// Places beneath a plane, `margin` from its rim, at some depths.
inline std::vector<Eigen::Vector3d> places_beneath(std::initializer_list<double> depths,
                                                   double margin = 6) {
    std::vector<Eigen::Vector3d> places;
    for (const double depth : depths)
        for (double y = -kSurfaceHeight / 2 + margin; y <= kSurfaceHeight / 2 - margin; y += 6.7)
            for (double x = -kSurfaceWidth / 2 + margin; x <= kSurfaceWidth / 2 - margin; x += 7.3)
                places.emplace_back(x, y, kSurfaceZ + depth);
    return places;
}

inline ClosedMesh box_mesh(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    std::vector<float> xyz;
    for (int corner = 0; corner < 8; ++corner)
        for (int axis = 0; axis < 3; ++axis)
            xyz.push_back(static_cast<float>((corner >> axis & 1) != 0 ? high[axis] : low[axis]));
    const std::vector<uint32_t> triangles{0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                          2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    return ClosedMesh({xyz.data(), 8, triangles.data(), 12}, "box");
}

inline Eigen::Isometry3d motion_of(double angle, const Eigen::Vector3d& axis,
                                   const Eigen::Vector3d& shift) {
    Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
    motion.linear() = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
    motion.translation() = shift;
    return motion;
}

inline Eigen::Isometry3d large_motion() { return motion_of(2.2, {0.4, -1, 0.6}, {60, -90, 120}); }

}  // namespace defrec::test
