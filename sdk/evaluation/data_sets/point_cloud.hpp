// Points of a surface without triangles, and the nearest of them to a place.
#pragma once

#include <cstddef>
#include <filesystem>
#include <opencv2/core.hpp>
#include <vector>

namespace defrec::cli {

// The vertices of a PLY file that have finite coordinates, in the file's unit. Throws
// CliError(kInput) for a file that is none or has no such vertex.
std::vector<cv::Point3f> read_point_cloud(const std::filesystem::path& path);

class PointCloud {
  public:
    // At least one point.
    explicit PointCloud(std::vector<cv::Point3f> points);

    // Distance of the nearest point. Any thread.
    double distance(const cv::Point3d& place) const;

  private:
    // points_[first .. last) are divided at their middle one along the axis of their depth, so
    // halves are trees of their own.
    void build(std::size_t first, std::size_t last, int axis);
    void search(const cv::Point3d& place, std::size_t first, std::size_t last, int axis,
                double& squared) const;

    std::vector<cv::Point3f> points_;
};

}  // namespace defrec::cli
