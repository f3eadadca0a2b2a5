// Which point of the deformed surface each pixel of an eye sees.
#include "mesh_raster.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "parallel_rows.hpp"

namespace defrec::cli {
namespace {

constexpr double kNearest = 5.0;  // mm, in front of the lens

}  // namespace

DeformedMesh::DeformedMesh(double half_width, double half_height, double spacing_mm)
    : columns(2 * static_cast<int>(std::ceil(half_width / spacing_mm)) + 1),
      rows(2 * static_cast<int>(std::ceil(half_height / spacing_mm)) + 1),
      spacing(spacing_mm),
      first_s(-0.5 * (columns - 1) * spacing_mm),
      first_t(-0.5 * (rows - 1) * spacing_mm),
      points(static_cast<std::size_t>(columns) * rows),
      normals(points.size()) {}

void DeformedMesh::deform(const Surface& surface, double time, const Motion& motion, int threads) {
    parallel_rows(rows, threads, [&](int first, int last) {
        for (int j = first; j < last; ++j) {
            for (int i = 0; i < columns; ++i) {
                points[static_cast<std::size_t>(j) * columns + i] =
                    surface.at(first_s + i * spacing, first_t + j * spacing, time, motion);
            }
        }
    });
    parallel_rows(rows, threads, [&](int first, int last) {
        for (int j = first; j < last; ++j) {
            const std::size_t above = static_cast<std::size_t>(std::max(j - 1, 0)) * columns;
            const std::size_t below = static_cast<std::size_t>(std::min(j + 1, rows - 1)) * columns;
            const std::size_t here = static_cast<std::size_t>(j) * columns;
            for (int i = 0; i < columns; ++i) {
                const Eigen::Vector3d along_s =
                    points[here + std::min(i + 1, columns - 1)] - points[here + std::max(i - 1, 0)];
                const Eigen::Vector3d along_t = points[below + i] - points[above + i];
                normals[here + i] = along_t.cross(along_s).normalized().cast<float>();
            }
        }
    });
}

Eye::Eye(const Lens& its_lens, int its_width, int its_height, int threads)
    : lens(its_lens), width(its_width), height(its_height), rays(static_cast<std::size_t>(width) * height) {
    parallel_rows(height, threads, [&](int first, int last) {
        for (int v = first; v < last; ++v) {
            for (int u = 0; u < width; ++u) {
                rays[static_cast<std::size_t>(v) * width + u] =
                    lens.ray({static_cast<double>(u), static_cast<double>(v)}).cast<float>();
            }
        }
    });
}

void MeshRaster::render(const DeformedMesh& mesh, const Eye& eye, int threads, std::vector<Hit>& hits) {
    seen_.resize(mesh.points.size());
    hits.assign(static_cast<std::size_t>(eye.width) * eye.height, Hit{});
    parallel_rows(mesh.rows, threads, [&](int first, int last) {
        const std::size_t end = static_cast<std::size_t>(last) * mesh.columns;
        for (std::size_t i = static_cast<std::size_t>(first) * mesh.columns; i < end; ++i) {
            const Eigen::Vector3d point = eye.from_scene(mesh.points[i]);
            seen_[i] = {point, -1e6f, -1e6f};
            // Far outside the image the distortion polynomial folds back; such points are not projected.
            if (point.z() > kNearest && point.head<2>().cwiseAbs().maxCoeff() < 0.85 * point.z()) {
                const Eigen::Vector2d pixel = eye.lens.project(point);
                seen_[i].u = static_cast<float>(pixel.x());
                seen_[i].v = static_cast<float>(pixel.y());
            }
        }
    });
    parallel_rows(eye.height, threads, [&](int first, int last) { band(mesh, eye, first, last, hits); });
}

void MeshRaster::band(const DeformedMesh& mesh, const Eye& eye, int first, int last,
                      std::vector<Hit>& hits) const {
    for (int j = 0; j + 1 < mesh.rows; ++j) {
        for (int i = 0; i + 1 < mesh.columns; ++i) {
            const int a = j * mesh.columns + i;
            const int b = a + 1, c = a + mesh.columns, d = c + 1;
            triangle(mesh, eye, {a, b, c}, first, last, hits);
            triangle(mesh, eye, {b, d, c}, first, last, hits);
        }
    }
}

void MeshRaster::triangle(const DeformedMesh& mesh, const Eye& eye, const int (&corner)[3], int first,
                          int last, std::vector<Hit>& hits) const {
    const Seen& p = seen_[corner[0]];
    const Seen& q = seen_[corner[1]];
    const Seen& r = seen_[corner[2]];
    const float low_u = std::min({p.u, q.u, r.u}), high_u = std::max({p.u, q.u, r.u});
    const float low_v = std::min({p.v, q.v, r.v}), high_v = std::max({p.v, q.v, r.v});
    if (low_u < -1e5f || low_v < -1e5f) {
        return;
    }
    const int v0 = std::max(first, static_cast<int>(std::floor(low_v)));
    const int v1 = std::min(last - 1, static_cast<int>(std::ceil(high_v)));
    const int u0 = std::max(0, static_cast<int>(std::floor(low_u)));
    const int u1 = std::min(eye.width - 1, static_cast<int>(std::ceil(high_u)));
    if (v0 > v1 || u0 > u1) {
        return;
    }
    // The ray d meets the plane at weights proportional to d.(q x r), d.(r x p), d.(p x q). The three cross
    // products of a shared edge are negatives of each other to the bit, so that no pixel falls between two
    // triangles.
    const Eigen::Vector3d np = q.point.cross(r.point);
    const Eigen::Vector3d nq = r.point.cross(p.point);
    const Eigen::Vector3d nr = p.point.cross(q.point);
    const double volume = p.point.dot(np);
    for (int v = v0; v <= v1; ++v) {
        for (int u = u0; u <= u1; ++u) {
            const std::size_t pixel = static_cast<std::size_t>(v) * eye.width + u;
            const double x = eye.rays[pixel].x(), y = eye.rays[pixel].y();
            const double wp = np.x() * x + np.y() * y + np.z();
            const double wq = nq.x() * x + nq.y() * y + nq.z();
            const double wr = nr.x() * x + nr.y() * y + nr.z();
            const bool inside = (wp >= 0 && wq >= 0 && wr >= 0) || (wp <= 0 && wq <= 0 && wr <= 0);
            const double sum = wp + wq + wr;
            if (!inside || sum == 0) {
                continue;
            }
            const auto z = static_cast<float>(volume / sum);
            Hit& hit = hits[pixel];
            if (z <= 0 || (hit.z > 0 && hit.z <= z)) {
                continue;
            }
            const double bp = wp / sum, bq = wq / sum, br = wr / sum;
            const auto material = [&](int index) {
                return Eigen::Vector2d(index % mesh.columns, index / mesh.columns);
            };
            const Eigen::Vector2d grid =
                bp * material(corner[0]) + bq * material(corner[1]) + br * material(corner[2]);
            hit.z = z;
            hit.s = static_cast<float>(mesh.first_s + mesh.spacing * grid.x());
            hit.t = static_cast<float>(mesh.first_t + mesh.spacing * grid.y());
            hit.normal = static_cast<float>(bp) * mesh.normals[corner[0]] +
                         static_cast<float>(bq) * mesh.normals[corner[1]] +
                         static_cast<float>(br) * mesh.normals[corner[2]];
        }
    }
}

}  // namespace defrec::cli
