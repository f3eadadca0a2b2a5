// For tests: an organ without any symmetry, and the part of it that a camera sees, with noise along
// the rays, holes, and an instrument in front.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "sdk/registration/pose.hpp"
#include "sdk/registration/surface_registration.hpp"

namespace defrec {

struct TestMesh {
    std::vector<float> vertices;
    std::vector<uint32_t> triangles;

    Eigen::Vector3d vertex(size_t i) const {
        return Eigen::Map<const Eigen::Vector3f>(&vertices[3 * i]).cast<double>();
    }
    void add(const Eigen::Vector3d& place) {
        for (int axis = 0; axis < 3; ++axis) vertices.push_back(static_cast<float>(place[axis]));
    }
};

// An icosahedron whose sides are divided so many times, its vertices moved by `shape` from the unit
// sphere: 20 * 4^divisions triangles.
template <class Shape>
TestMesh sphere_mesh(int divisions, const Shape& shape) {
    const double g = (1 + std::sqrt(5.0)) / 2;
    std::vector<Eigen::Vector3d> points;
    for (const double s : {-1.0, 1.0})
        for (const double t : {-g, g})
            for (int axis = 0; axis < 3; ++axis) {
                Eigen::Vector3d point;
                point[axis] = 0;
                point[(axis + 1) % 3] = s;
                point[(axis + 2) % 3] = t;
                points.push_back(point.normalized());
            }
    std::vector<std::array<uint32_t, 3>> triangles;
    const auto is_side = [&](uint32_t a, uint32_t b) {
        return (points[a] - points[b]).norm() < 1.1;
    };
    for (uint32_t a = 0; a < 12; ++a)
        for (uint32_t b = a + 1; b < 12; ++b)
            for (uint32_t c = b + 1; c < 12; ++c) {
                if (!is_side(a, b) || !is_side(b, c) || !is_side(a, c)) continue;
                const bool is_outside =
                    (points[b] - points[a]).cross(points[c] - points[a]).dot(points[a]) > 0;
                triangles.push_back(is_outside ? std::array{a, b, c} : std::array{a, c, b});
            }
    for (int round = 0; round < divisions; ++round) {
        std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
        const auto middle = [&](uint32_t a, uint32_t b) {
            const auto [found, is_new] =
                middles.emplace(std::minmax(a, b), static_cast<uint32_t>(points.size()));
            if (is_new) points.push_back((points[a] + points[b]).normalized());
            return found->second;
        };
        std::vector<std::array<uint32_t, 3>> finer;
        for (const auto& [a, b, c] : triangles) {
            const uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        triangles = std::move(finer);
    }
    TestMesh mesh;
    for (const Eigen::Vector3d& point : points) mesh.add(shape(point));
    for (const auto& triangle : triangles)
        mesh.triangles.insert(mesh.triangles.end(), triangle.begin(), triangle.end());
    return mesh;
}

// Like a liver: 190 mm wide, a large and a small lobe, a notch between them, hollow beneath, and
// bumps of several sizes that repeat nowhere.
inline Eigen::Vector3d organ_shape(const Eigen::Vector3d& d) {
    const auto bump = [&](double x, double y, double z, double sharp) {
        return std::exp(sharp * (d.dot(Eigen::Vector3d(x, y, z).normalized()) - 1));
    };
    double radius = 1 + 0.16 * bump(-1, 0.3, 0.1, 3) - 0.22 * bump(0.35, -0.8, -0.3, 9) -
                    0.18 * bump(0.1, 0.2, 1, 4) + 0.10 * bump(0.9, 0.2, -0.2, 6);
    radius += 0.05 * bump(-0.4, 0.6, -0.8, 14) - 0.045 * bump(0.2, 0.5, -0.9, 18) +
              0.04 * bump(-0.1, -0.5, -0.9, 25) - 0.035 * bump(0.6, 0, -0.9, 22) +
              0.03 * bump(-0.7, 0, -0.7, 30) - 0.03 * bump(-0.45, 0.1, -1, 35);
    radius -= 0.05 * std::exp(-std::pow((d.x() - 0.32 + 0.15 * d.y()) / 0.08, 2)) *
              (d.z() < 0 ? 1 : std::exp(-20 * d.z() * d.z()));
    return radius * Eigen::Vector3d(95 * d.x(), 62 * d.y(), 48 * d.z() + 9 * d.x() * d.x());
}

inline TestMesh organ_mesh(int divisions) { return sphere_mesh(divisions, organ_shape); }

struct TestView {
    std::vector<float> places, covariances;
    std::vector<uint8_t> is_instrument;
    double seen_share = 0;  // of the mesh's area
    SeenSurface seen() const { return {places, {}, covariances}; }
};

struct TestViewSetting {
    int columns = 76, rows = 54;
    double focal_length = 80;  // pixels
    double noise_mm = 0.3;     // along the ray
    double smooth_px = 0;      // noise is alike within so many pixels; 0: independent
    int holes = 4;
    bool has_instrument = true;
};

// What a camera at the origin, looking along z, sees of a mesh at a pose.
class TestCamera {
  public:
    TestCamera(const TestMesh& mesh, const Pose& pose, const TestViewSetting& setting)
        : setting_(setting), depth_(static_cast<size_t>(setting.columns * setting.rows), 0) {
        for (size_t i = 0; i < mesh.triangles.size(); i += 3)
            draw(pose * mesh.vertex(mesh.triangles[i]), pose * mesh.vertex(mesh.triangles[i + 1]),
                 pose * mesh.vertex(mesh.triangles[i + 2]));
    }

    template <class Random>
    TestView view(const TestMesh& mesh, Random& random) const {
        TestView made;
        std::normal_distribution<double> normal;
        std::uniform_real_distribution<double> uniform;
        const int count = setting_.columns * setting_.rows;
        std::vector<double> noise(static_cast<size_t>(count));
        for (double& value : noise) value = normal(random);
        if (setting_.smooth_px > 0) smooth(noise);
        std::vector<Eigen::Vector3d> holes;  // column, row, radius
        for (int i = 0; i < setting_.holes; ++i)
            holes.emplace_back(uniform(random) * setting_.columns, uniform(random) * setting_.rows,
                               2 + 3 * uniform(random));
        const Eigen::Vector3d tip(setting_.columns * (0.3 + 0.4 * uniform(random)),
                                  setting_.rows * (0.3 + 0.4 * uniform(random)), 0);
        const double angle = 2 * std::numbers::pi * uniform(random);
        double seen_area = 0;
        for (int i = 0; i < count; ++i) {
            const auto at = static_cast<size_t>(i);
            if (depth_[at] == 0) continue;
            const Eigen::Vector3d ray = ray_of(i % setting_.columns, i / setting_.columns);
            seen_area += area_[at];
            const Eigen::Vector3d pixel(i % setting_.columns, i / setting_.columns, 0);
            if (std::any_of(holes.begin(), holes.end(), [&](const Eigen::Vector3d& hole) {
                    return (pixel - hole).head<2>().norm() < hole.z();
                }))
                continue;
            double depth = depth_[at];
            const double along =
                (pixel - tip).dot(Eigen::Vector3d(std::cos(angle), std::sin(angle), 0));
            const double across =
                (pixel - tip).dot(Eigen::Vector3d(-std::sin(angle), std::cos(angle), 0));
            const bool is_instrument = setting_.has_instrument && along > 0 && std::abs(across) < 3;
            // A shaft that leaves the tissue at its tip towards the camera.
            if (is_instrument)
                depth = std::max(20.0, depth - 2 - 0.8 * along - std::sqrt(9 - across * across));
            // Depth is measured along z, so a point moves along its ray.
            add(made, ray, depth, noise[at]);
            made.is_instrument.push_back(is_instrument);
        }
        double area = 0;
        for (size_t i = 0; i < mesh.triangles.size(); i += 3) {
            const Eigen::Vector3d a = mesh.vertex(mesh.triangles[i]);
            area += (mesh.vertex(mesh.triangles[i + 1]) - a)
                        .cross(mesh.vertex(mesh.triangles[i + 2]) - a)
                        .norm() /
                    2;
        }
        made.seen_share = seen_area / area;
        return made;
    }

  private:
    Eigen::Vector3d ray_of(int column, int row) const {
        return {(column - (setting_.columns - 1) / 2.0) / setting_.focal_length,
                (row - (setting_.rows - 1) / 2.0) / setting_.focal_length, 1};
    }

    void add(TestView& made, const Eigen::Vector3d& ray, double depth, double noise) const {
        const Eigen::Vector3d along = ray.normalized();
        const Eigen::Vector3d place = depth * ray + setting_.noise_mm * noise * along;
        constexpr double kAcross = 0.05;
        const Eigen::Matrix3d covariance =
            setting_.noise_mm * setting_.noise_mm * along * along.transpose() +
            kAcross * kAcross * Eigen::Matrix3d::Identity();
        for (int axis = 0; axis < 3; ++axis) made.places.push_back(static_cast<float>(place[axis]));
        for (const auto& [i, k] : {std::pair(0, 0), {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}})
            made.covariances.push_back(static_cast<float>(covariance(i, k)));
    }

    // White noise that a Gaussian smooths, of the same variance.
    void smooth(std::vector<double>& noise) const {
        const int reach = static_cast<int>(std::ceil(3 * setting_.smooth_px));
        std::vector<double> weights;
        double squares = 0;
        for (int i = -reach; i <= reach; ++i) {
            weights.push_back(std::exp(-0.5 * i * i / (setting_.smooth_px * setting_.smooth_px)));
            squares += weights.back() * weights.back();
        }
        const auto pass = [&](int size, int stride, int lines, int line_stride) {
            std::vector<double> after(noise.size());
            for (int line = 0; line < lines; ++line)
                for (int i = 0; i < size; ++i) {
                    double sum = 0;
                    for (int k = -reach; k <= reach; ++k)
                        sum += weights[static_cast<size_t>(k + reach)] *
                               noise[static_cast<size_t>(line * line_stride +
                                                         (i + k + size) % size * stride)];
                    after[static_cast<size_t>(line * line_stride + i * stride)] =
                        sum / std::sqrt(squares);
                }
            noise = after;
        };
        pass(setting_.columns, 1, setting_.rows, setting_.columns);
        pass(setting_.rows, setting_.columns, setting_.columns, 1);
    }

    void draw(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
        const double least = 1;
        if (a.z() < least || b.z() < least || c.z() < least) return;
        const auto column = [&](const Eigen::Vector3d& p) {
            return setting_.focal_length * p.x() / p.z() + (setting_.columns - 1) / 2.0;
        };
        const auto row = [&](const Eigen::Vector3d& p) {
            return setting_.focal_length * p.y() / p.z() + (setting_.rows - 1) / 2.0;
        };
        const auto [left, right] = std::minmax({column(a), column(b), column(c)});
        const auto [top, bottom] = std::minmax({row(a), row(b), row(c)});
        const Eigen::Vector3d normal = (b - a).cross(c - a);
        for (int v = std::max(0, static_cast<int>(std::ceil(top)));
             v <= std::min(setting_.rows - 1, static_cast<int>(std::floor(bottom))); ++v)
            for (int u = std::max(0, static_cast<int>(std::ceil(left)));
                 u <= std::min(setting_.columns - 1, static_cast<int>(std::floor(right))); ++u) {
                const Eigen::Vector3d ray = ray_of(u, v);
                const double side_a = ray.dot(a.cross(b)), side_b = ray.dot(b.cross(c)),
                             side_c = ray.dot(c.cross(a));
                const bool is_inside = (side_a >= 0 && side_b >= 0 && side_c >= 0) ||
                                       (side_a <= 0 && side_b <= 0 && side_c <= 0);
                if (!is_inside || normal.dot(ray) == 0) continue;
                const double depth = normal.dot(a) / normal.dot(ray);
                const auto at = static_cast<size_t>(v * setting_.columns + u);
                if (depth_[at] != 0 && depth_[at] <= depth) continue;
                depth_[at] = depth;
                if (area_.empty()) area_.resize(depth_.size());
                const double slant = std::abs(normal.normalized().dot(ray.normalized()));
                area_[at] = depth * depth * ray.norm() /
                            (setting_.focal_length * setting_.focal_length * std::max(slant, 0.05));
            }
    }

    TestViewSetting setting_;
    std::vector<double> depth_, area_;  // of each pixel, mm, mm^2; 0: nothing
};

template <class Random>
Eigen::Vector3d random_direction(Random& random) {
    std::normal_distribution<double> normal;
    return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
}

// A pose at which a camera sees the front of the organ (-z, where the lobes are) from so far away.
template <class Random>
Pose organ_pose(Random& random, double distance_mm, double tilt) {
    std::uniform_real_distribution<double> uniform(-1, 1);
    const Eigen::Matrix3d turn =
        rotation_of(std::numbers::pi * uniform(random) * Eigen::Vector3d::UnitZ()) *
        rotation_of(tilt * uniform(random) * random_direction(random));
    const Eigen::Vector3d aim(25 * uniform(random), 15 * uniform(random), -50);
    return {turn, Eigen::Vector3d(0, 0, distance_mm) - turn * aim};
}

// A start that is off by at most so much, about a place of the model.
template <class Random>
Pose off_by(const Pose& pose, const Eigen::Vector3d& about, double turn, double shift_mm,
            Random& random) {
    std::uniform_real_distribution<double> uniform;
    Twist twist;
    const double angle = turn * uniform(random), length = shift_mm * uniform(random);
    twist << angle * random_direction(random), length * random_direction(random);
    return moved(pose, twist, pose * about);
}

}  // namespace defrec
