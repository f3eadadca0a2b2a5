// Lays the lattice over the template and evaluates it for a frame.
#include "sdk/report/surface_lattice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace defrec::cli {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr double kMaxPlaces = 1e6;

bool finite(const float* values, int count) {
    return std::all_of(values, values + count, [](float v) { return std::isfinite(v); });
}

/// A vertex without a place in the image (behind the camera) or in space takes its triangles with
/// it.
bool finite_triangle(const TemplateRecord& reference, std::size_t triangle) {
    for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t corner = reference.triangles[3 * triangle + k];
        if (!finite(reference.vertex_uv.data() + 2 * corner, 2) ||
            !finite(reference.vertices.data() + 3 * corner, 3))
            return false;
    }
    return true;
}

}  // namespace

void check_template(const TemplateRecord& reference) {
    const std::size_t count = reference.vertices.size() / 3;
    if (reference.vertices.size() % 3 != 0 || reference.vertex_uv.size() != 2 * count)
        throw std::invalid_argument("template: " + std::to_string(reference.vertices.size()) +
                                    " coordinates need two thirds as many vertex_uv, got " +
                                    std::to_string(reference.vertex_uv.size()));
    if (reference.triangles.size() % 3 != 0)
        throw std::invalid_argument("template: triangles hold three indices each, got " +
                                    std::to_string(reference.triangles.size()) + " indices");
    for (const std::uint32_t corner : reference.triangles)
        if (corner >= count)
            throw std::invalid_argument("template: a triangle names vertex " +
                                        std::to_string(corner) + " of " + std::to_string(count));
}

double template_area(const TemplateRecord& reference) {
    double area = 0;
    const float* uv = reference.vertex_uv.data();
    for (std::size_t t = 0; t < reference.triangles.size() / 3; ++t) {
        if (!finite_triangle(reference, t)) continue;
        const float* a = uv + 2 * std::size_t{reference.triangles[3 * t]};
        const float* b = uv + 2 * std::size_t{reference.triangles[3 * t + 1]};
        const float* c = uv + 2 * std::size_t{reference.triangles[3 * t + 2]};
        area += 0.5 * std::abs(double(b[0] - a[0]) * double(c[1] - a[1]) -
                               double(b[1] - a[1]) * double(c[0] - a[0]));
    }
    return area;
}

bool has_geometry(const FrameRecord& frame, std::size_t vertices) {
    return vertices > 0 && frame.vertices.size() == 3 * vertices &&
           frame.vertex_status.size() == vertices &&
           (frame.expected_error_mm.empty() || frame.expected_error_mm.size() == vertices);
}

SurfaceLattice::SurfaceLattice(const TemplateRecord& reference, double step) {
    if (reference.triangles.empty()) return;
    float max_u = -std::numeric_limits<float>::infinity(), max_v = max_u;
    origin_u_ = origin_v_ = std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i + 1 < reference.vertex_uv.size(); i += 2) {
        if (!finite(reference.vertex_uv.data() + i, 2)) continue;
        origin_u_ = std::min(origin_u_, reference.vertex_uv[i]);
        origin_v_ = std::min(origin_v_, reference.vertex_uv[i + 1]);
        max_u = std::max(max_u, reference.vertex_uv[i]);
        max_v = std::max(max_v, reference.vertex_uv[i + 1]);
    }
    if (!(max_u >= origin_u_)) return;
    const double width = double(max_u) - double(origin_u_),
                 height = double(max_v) - double(origin_v_);
    while ((width / step + 1) * (height / step + 1) > kMaxPlaces) step *= 2;
    columns_ = static_cast<int>(width / step) + 1;
    rows_ = static_cast<int>(height / step) + 1;
    index_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), -1);
    is_covered_.assign(finer_columns() * static_cast<std::size_t>((rows_ - 1) * kFiner + 1), 0);
    for (std::size_t t = 0; t < reference.triangles.size() / 3; ++t)
        if (finite_triangle(reference, t)) add_triangle(reference, t, step);
}

void SurfaceLattice::add_triangle(const TemplateRecord& reference, std::size_t triangle,
                                  double step) {
    const std::uint32_t* corner = reference.triangles.data() + 3 * triangle;
    double u[3], v[3];
    for (int k = 0; k < 3; ++k) {
        u[k] = double(reference.vertex_uv[2 * std::size_t{corner[k]}]) - double(origin_u_);
        v[k] = double(reference.vertex_uv[2 * std::size_t{corner[k]} + 1]) - double(origin_v_);
    }
    const double area = (u[1] - u[0]) * (v[2] - v[0]) - (v[1] - v[0]) * (u[2] - u[0]);
    if (std::abs(area) < 1e-9) return;
    const double fine = step / kFiner;
    const int last_column = std::min((columns_ - 1) * kFiner,
                                     static_cast<int>(std::max({u[0], u[1], u[2]}) / fine)),
              last_row = std::min((rows_ - 1) * kFiner,
                                  static_cast<int>(std::max({v[0], v[1], v[2]}) / fine));
    for (int row = static_cast<int>(std::ceil(std::min({v[0], v[1], v[2]}) / fine));
         row <= last_row; ++row)
        for (int column = static_cast<int>(std::ceil(std::min({u[0], u[1], u[2]}) / fine));
             column <= last_column; ++column) {
            const double pu = column * fine, pv = row * fine;
            const double w1 = ((pu - u[0]) * (v[2] - v[0]) - (pv - v[0]) * (u[2] - u[0])) / area;
            const double w2 = ((u[1] - u[0]) * (pv - v[0]) - (v[1] - v[0]) * (pu - u[0])) / area;
            const double w0 = 1 - w1 - w2;
            // The margin lets places on a shared edge fall into one of its triangles whatever the
            // rounding.
            if (std::min({w0, w1, w2}) < -1e-6) continue;
            is_covered_[static_cast<std::size_t>(row) * finer_columns() +
                        static_cast<std::size_t>(column)] = 1;
            const float weight[3] = {static_cast<float>(w0), static_cast<float>(w1),
                                     static_cast<float>(w2)};
            if (row % kFiner == 0 && column % kFiner == 0)
                place_node(corner, weight, column / kFiner, row / kFiner, step);
        }
}

void SurfaceLattice::place_node(const std::uint32_t* corner, const float* weight, int column,
                                int row, double step) {
    std::int32_t& place =
        index_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
               static_cast<std::size_t>(column)];
    if (place >= 0) return;
    place = static_cast<std::int32_t>(nodes_.size());
    nodes_.push_back({{corner[0], corner[1], corner[2]}, {weight[0], weight[1], weight[2]}});
    uv_.push_back(static_cast<float>(column * step + double(origin_u_)));
    uv_.push_back(static_cast<float>(row * step + double(origin_v_)));
}

void SurfaceLattice::part_like(const SurfaceLattice& parted) {
    if (parted.is_covered_.size() == is_covered_.size()) is_covered_ = parted.is_covered_;
}

bool SurfaceLattice::covers(int column, int row, int width, int height) const {
    if (column < 0 || row < 0 || column + width >= columns_ || row + height >= rows_) return false;
    for (int y = row * kFiner; y <= (row + height) * kFiner; ++y)
        for (int x = column * kFiner; x <= (column + width) * kFiner; ++x)
            if (is_covered_[static_cast<std::size_t>(y) * finer_columns() +
                            static_cast<std::size_t>(x)] == 0)
                return false;
    return true;
}

std::int32_t SurfaceLattice::node(int column, int row) const {
    if (column < 0 || row < 0 || column >= columns_ || row >= rows_) return -1;
    return index_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                  static_cast<std::size_t>(column)];
}

std::vector<std::uint32_t> SurfaceLattice::triangles() const {
    std::vector<std::uint32_t> result;
    for (int row = 0; row + 1 < rows_; ++row)
        for (int column = 0; column + 1 < columns_; ++column) {
            const std::int32_t a = node(column, row), b = node(column + 1, row);
            const std::int32_t c = node(column, row + 1), d = node(column + 1, row + 1);
            if (!covers(column, row, 1, 1)) continue;
            for (const std::int32_t corner : {a, b, c, b, d, c})
                result.push_back(static_cast<std::uint32_t>(corner));
        }
    return result;
}

std::vector<float> SurfaceLattice::evaluate(const std::vector<float>& vertices) const {
    std::vector<float> xyz(3 * nodes_.size());
    for (std::size_t n = 0; n < nodes_.size(); ++n)
        for (std::size_t axis = 0; axis < 3; ++axis) {
            float sum = 0;
            for (int k = 0; k < 3; ++k)
                sum += nodes_[n].weight[k] * vertices[3 * std::size_t{nodes_[n].corner[k]} + axis];
            xyz[3 * n + axis] = sum;
        }
    return xyz;
}

void SurfaceLattice::evaluate(const FrameRecord& frame, LatticeState& state) const {
    state.xyz = evaluate(frame.vertices);
    state.status.resize(nodes_.size());
    state.error_mm.assign(nodes_.size(), kNan);
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
        const Node& node = nodes_[n];
        VertexStatus status = VertexStatus::observed;
        float error = 0;
        for (int k = 0; k < 3; ++k) {
            status = std::max(status, frame.vertex_status[node.corner[k]]);
            if (!frame.expected_error_mm.empty())
                error += node.weight[k] * frame.expected_error_mm[node.corner[k]];
        }
        float* p = state.xyz.data() + 3 * n;
        if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2])) {
            p[0] = p[1] = p[2] = kNan;
            status = VertexStatus::unknown;
        }
        state.status[n] = status;
        if (!frame.expected_error_mm.empty()) state.error_mm[n] = error;
    }
}

}  // namespace defrec::cli
