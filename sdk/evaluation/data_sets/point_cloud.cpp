// See point_cloud.hpp. A k-d tree in the order of its points (Bentley, 1975).
#include "sdk/evaluation/data_sets/point_cloud.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sdk/io/decisions.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/ply_file.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

template <class Point>
auto coordinate(const Point& point, int axis) {
    return axis == 0 ? point.x : axis == 1 ? point.y : point.z;
}

int next_axis(int axis) { return (axis + 1) % 3; }

}  // namespace

std::vector<cv::Point3f> read_point_cloud(const std::filesystem::path& path) {
    const PlyFile file =
        read_ply(read_file(path, decisions::MeshFiles::kMaxBytes, ExitCode::kInput), path.string());
    const auto *x = file.find("x"), *y = file.find("y"), *z = file.find("z");
    std::vector<cv::Point3f> points;
    for (std::size_t i = 0; x && y && z && i < file.vertex_count; ++i) {
        const cv::Point3d point((*x)[i], (*y)[i], (*z)[i]);
        if (std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z))
            points.emplace_back(point);
    }
    if (!points.empty()) return points;
    throw CliError(ExitCode::kInput,
                   path.string() + ": points with finite x, y and z were expected; there is none.");
}

PointCloud::PointCloud(std::vector<cv::Point3f> points) : points_(std::move(points)) {
    build(0, points_.size(), 0);
}

void PointCloud::build(std::size_t first, std::size_t last, int axis) {
    if (last - first < 2) return;
    const std::size_t middle = first + (last - first) / 2;
    const auto begin = points_.begin();
    std::nth_element(
        begin + static_cast<std::ptrdiff_t>(first), begin + static_cast<std::ptrdiff_t>(middle),
        begin + static_cast<std::ptrdiff_t>(last),
        [&](const auto& a, const auto& b) { return coordinate(a, axis) < coordinate(b, axis); });
    build(first, middle, next_axis(axis));
    build(middle + 1, last, next_axis(axis));
}

void PointCloud::search(const cv::Point3d& place, std::size_t first, std::size_t last, int axis,
                        double& squared) const {
    if (first == last) return;
    const std::size_t middle = first + (last - first) / 2;
    const cv::Point3d away = place - cv::Point3d(points_[middle]);
    squared = std::min(squared, away.dot(away));
    const double beyond = coordinate(away, axis);
    const auto below = [&] { search(place, first, middle, next_axis(axis), squared); };
    const auto above = [&] { search(place, middle + 1, last, next_axis(axis), squared); };
    if (beyond < 0) {
        below();
        if (beyond * beyond < squared) above();
    } else {
        above();
        if (beyond * beyond < squared) below();
    }
}

double PointCloud::distance(const cv::Point3d& place) const {
    double squared = std::numeric_limits<double>::infinity();
    search(place, 0, points_.size(), 0, squared);
    return std::sqrt(squared);
}

}  // namespace defrec::cli
