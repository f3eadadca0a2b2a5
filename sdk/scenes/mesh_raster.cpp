// Which point of the deformed surface each pixel of a view sees.
#include "sdk/scenes/mesh_raster.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "sdk/scenes/parallel_rows.hpp"

namespace defrec::cli {
namespace {

constexpr double kNearest = 5.0;  // mm, in front of the lens
constexpr int kWindowStep = 8;    // vertices
constexpr float kWindowMargin =
    0.1f;  // of a ray's slope: more than a window step at any scene's depth

}  // namespace

Lattice centred_lattice(double half_width, double half_height, double spacing_s, double spacing_t) {
    Lattice lattice;
    lattice.columns = 2 * static_cast<int>(std::ceil(half_width / spacing_s)) + 1;
    lattice.rows = 2 * static_cast<int>(std::ceil(half_height / spacing_t)) + 1;
    lattice.spacing_s = spacing_s;
    lattice.spacing_t = spacing_t;
    lattice.first_s = -0.5 * (lattice.columns - 1) * spacing_s;
    lattice.first_t = -0.5 * (lattice.rows - 1) * spacing_t;
    return lattice;
}

DeformedMesh::DeformedMesh(const Lattice& lattice)
    : Lattice(lattice),
      last_drawn(rows - 1),
      points(static_cast<std::size_t>(columns) * rows),
      normals(points.size()) {}

LatticeWindow DeformedMesh::seen_window(const MeshFormula& at,
                                        const std::vector<const View*>& views) const {
    LatticeWindow seen{columns, -1, rows, -1};
    const int first = std::max(first_drawn - kWindowStep, 0);
    const int last = std::min(last_drawn + kWindowStep, rows - 1);
    for (int j = first - first % kWindowStep; j <= last; j += kWindowStep) {
        for (int i = 0; i < columns; i += kWindowStep) {
            const Eigen::Vector3d point = at(first_s + i * spacing_s, first_t + j * spacing_t);
            for (const View* view : views) {
                const Eigen::Vector3d p = view->from_scene(point);
                const Eigen::Vector2f ray = (p.head<2>() / std::max(p.z(), kNearest)).cast<float>();
                if (((ray - view->lowest_ray).array() > -kWindowMargin).all() &&
                    ((view->highest_ray - ray).array() > -kWindowMargin).all()) {
                    seen.first_column = std::min(seen.first_column, i);
                    seen.last_column = std::max(seen.last_column, i);
                    seen.first_row = std::min(seen.first_row, j);
                    seen.last_row = std::max(seen.last_row, j);
                }
            }
        }
    }
    return {std::max(seen.first_column - kWindowStep, 0),
            std::min(seen.last_column + kWindowStep, columns - 1),
            std::max({seen.first_row - kWindowStep, first_drawn - 1, 0}),
            std::min({seen.last_row + kWindowStep, last_drawn + 1, rows - 1})};
}

void DeformedMesh::deform(const MeshFormula& at, const std::vector<const View*>& views,
                          int threads) {
    window = seen_window(at, views);
    const LatticeWindow& w = window;
    parallel_rows(w.last_row - w.first_row + 1, threads, [&](int first, int last) {
        for (int j = w.first_row + first; j < w.first_row + last; ++j) {
            for (int i = w.first_column; i <= w.last_column; ++i) {
                points[static_cast<std::size_t>(j) * columns + i] =
                    at(first_s + i * spacing_s, first_t + j * spacing_t);
            }
        }
    });
    parallel_rows(w.last_row - w.first_row + 1, threads, [&](int first, int last) {
        for (int j = w.first_row + first; j < w.first_row + last; ++j) {
            const std::size_t above =
                static_cast<std::size_t>(std::max(j - 1, w.first_row)) * columns;
            const std::size_t below =
                static_cast<std::size_t>(std::min(j + 1, w.last_row)) * columns;
            const std::size_t here = static_cast<std::size_t>(j) * columns;
            for (int i = w.first_column; i <= w.last_column; ++i) {
                const Eigen::Vector3d along_s = points[here + std::min(i + 1, w.last_column)] -
                                                points[here + std::max(i - 1, w.first_column)];
                const Eigen::Vector3d along_t = points[below + i] - points[above + i];
                normals[here + i] = along_t.cross(along_s).normalized().cast<float>();
            }
        }
    });
}

View::View(const Lens& its_lens, int its_width, int its_height, int threads)
    : lens(its_lens),
      width(its_width),
      height(its_height),
      rays(static_cast<std::size_t>(width) * height) {
    parallel_rows(height, threads, [&](int first, int last) {
        for (int v = first; v < last; ++v) {
            for (int u = 0; u < width; ++u) {
                rays[static_cast<std::size_t>(v) * width + u] =
                    lens.ray({static_cast<double>(u), static_cast<double>(v)}).cast<float>();
            }
        }
    });
    lowest_ray = highest_ray = rays[0];
    for (const Eigen::Vector2f& ray : rays) {
        lowest_ray = lowest_ray.cwiseMin(ray);
        highest_ray = highest_ray.cwiseMax(ray);
    }
}

void MeshRaster::render(const std::vector<DeformedMesh>& meshes, const View& view, int threads,
                        std::vector<Hit>& hits) {
    hits.assign(static_cast<std::size_t>(view.width) * view.height, Hit{});
    for (std::size_t i = 0; i < meshes.size(); ++i) {
        const Numbered numbered{meshes[i], static_cast<std::uint8_t>(i)};
        project(meshes[i], view, threads);
        parallel_rows(view.height, threads,
                      [&](int first, int last) { band(numbered, view, first, last, hits); });
    }
}

void MeshRaster::project(const DeformedMesh& mesh, const View& view, int threads) {
    seen_.resize(mesh.points.size());
    const LatticeWindow& w = mesh.window;
    parallel_rows(w.last_row - w.first_row + 1, threads, [&](int first, int last) {
        for (int j = w.first_row + first; j < w.first_row + last; ++j) {
            for (int column = w.first_column; column <= w.last_column; ++column) {
                const std::size_t i = static_cast<std::size_t>(j) * mesh.columns + column;
                const Eigen::Vector3d point = view.from_scene(mesh.points[i]);
                seen_[i] = {point, -1e6f, -1e6f};
                // Far outside the image the distortion polynomial folds back; such points are not
                // projected.
                if (point.z() > kNearest &&
                    point.head<2>().cwiseAbs().maxCoeff() < 0.85 * point.z()) {
                    const Eigen::Vector2d pixel = view.lens.project(point);
                    seen_[i].u = static_cast<float>(pixel.x());
                    seen_[i].v = static_cast<float>(pixel.y());
                }
            }
        }
    });
}

void MeshRaster::band(const Numbered& numbered, const View& view, int first, int last,
                      std::vector<Hit>& hits) const {
    const DeformedMesh& mesh = numbered.mesh;
    const LatticeWindow &w = mesh.window, &hole = mesh.hole;
    const int end = std::min(w.last_row, mesh.last_drawn);
    for (int j = std::max(w.first_row, mesh.first_drawn); j < end; ++j) {
        const bool beside_hole = j >= hole.first_row && j < hole.last_row;
        for (int i = w.first_column; i < w.last_column; ++i) {
            if (beside_hole && i >= hole.first_column && i < hole.last_column) {
                continue;
            }
            const int a = j * mesh.columns + i;
            const int b = a + 1, c = a + mesh.columns, d = c + 1;
            triangle(numbered, view, {a, b, c}, first, last, hits);
            triangle(numbered, view, {b, d, c}, first, last, hits);
        }
    }
}

void MeshRaster::triangle(const Numbered& numbered, const View& view, const int (&corner)[3],
                          int first, int last, std::vector<Hit>& hits) const {
    const DeformedMesh& mesh = numbered.mesh;
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
    const int u1 = std::min(view.width - 1, static_cast<int>(std::ceil(high_u)));
    if (v0 > v1 || u0 > u1) {
        return;
    }
    // The ray d meets the plane at weights proportional to d.(q x r), d.(r x p), d.(p x q). The
    // three cross products of a shared edge are negatives of each other to the bit, so that no
    // pixel falls between two triangles.
    const Eigen::Vector3d np = q.point.cross(r.point);
    const Eigen::Vector3d nq = r.point.cross(p.point);
    const Eigen::Vector3d nr = p.point.cross(q.point);
    const double volume = p.point.dot(np);
    for (int v = v0; v <= v1; ++v) {
        for (int u = u0; u <= u1; ++u) {
            const std::size_t pixel = static_cast<std::size_t>(v) * view.width + u;
            const double x = view.rays[pixel].x(), y = view.rays[pixel].y();
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
            hit.s = static_cast<float>(mesh.first_s + mesh.spacing_s * grid.x());
            hit.t = static_cast<float>(mesh.first_t + mesh.spacing_t * grid.y());
            hit.mesh = numbered.number;
            hit.normal = static_cast<float>(bp) * mesh.normals[corner[0]] +
                         static_cast<float>(bq) * mesh.normals[corner[1]] +
                         static_cast<float>(br) * mesh.normals[corner[2]];
        }
    }
}

}  // namespace defrec::cli
