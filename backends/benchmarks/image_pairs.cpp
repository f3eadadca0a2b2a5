// Reading scenes, and interpolating their truth.
#include "backends/benchmarks/image_pairs.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "sdk/base/util/median.hpp"

namespace defrec::benchmarks {
namespace {

constexpr size_t kNeighbours = 6;

GrayImage read_image(const std::string& path) {
    const cv::Mat image = cv::imread(path, cv::IMREAD_GRAYSCALE);
    if (image.empty()) throw std::runtime_error("cannot read " + path);
    return {uint32_t(image.cols), uint32_t(image.rows), {image.data, image.data + image.total()}};
}

struct Camera {
    cv::Mat matrix, distortion,
        turn;  // turn: from the rectified camera to the raw one, as a rotation vector
    Point project(const cv::Point3d& point) const {
        std::vector<cv::Point2d> pixel;
        cv::projectPoints(std::vector<cv::Point3d>{point}, turn, cv::Vec3d(0, 0, 0), matrix,
                          distortion, pixel);
        return {pixel[0].x, pixel[0].y};
    }
};

Camera read_camera(const std::string& path, cv::Size size) {
    const cv::FileStorage file(path, cv::FileStorage::READ);
    cv::Mat m1, d1, m2, d2, rotation, translation, r1, r2, p1, p2, q;
    file["M1"] >> m1;
    file["D1"] >> d1;
    file["M2"] >> m2;
    file["D2"] >> d2;
    file["R"] >> rotation;
    file["T"] >> translation;
    cv::stereoRectify(m1, d1, m2, d2, size, rotation, translation, r1, r2, p1, p2, q);
    Camera camera{m1, d1, {}};
    cv::Rodrigues(r1.t(), camera.turn);
    return camera;
}

struct Sighting {
    cv::Point3d point;
    bool visible;
};
using Truth = std::map<size_t, std::map<int, Sighting>>;  // by frame and id

Truth read_truth(const std::string& path) {
    Truth truth;
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
        unsigned long frame;
        int id, visible;
        cv::Point3d p;
        if (std::sscanf(line.c_str(), "%lu,%d,%lf,%lf,%lf,%d", &frame, &id, &p.x, &p.y, &p.z,
                        &visible) == 6)
            truth[frame][id] = {p, visible != 0};
    }
    return truth;
}

std::map<int, Point> read_points(const std::string& path) {
    std::map<int, Point> points;
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
        int id;
        Point p;
        if (std::sscanf(line.c_str(), "%d,%lf,%lf", &id, &p.x, &p.y) == 3) points[id] = p;
    }
    return points;
}

// Truth and points are written by different hands; a wrong camera model would spoil every number
// that follows.
void check_agreement(const std::string& folder, const Camera& camera,
                     const std::map<int, Point>& points, const std::map<int, Sighting>& first) {
    std::vector<double> errors;
    for (const auto& [id, point] : points)
        if (const auto found = first.find(id); found != first.end()) {
            const Point p = camera.project(found->second.point);
            errors.push_back(std::hypot(p.x - point.x, p.y - point.y));
        }
    if (errors.empty())
        throw std::runtime_error(folder + ": no point of points.csv is in truth.csv");
    if (const double error = median(std::move(errors)); error > 0.5)
        throw std::runtime_error(folder + ": truth.csv and points.csv are " +
                                 std::to_string(error) + " px apart");
}

}  // namespace

Flow Flow::homography(const double (&row_major)[9]) {
    Flow flow;
    flow.homography_.assign(row_major, row_major + 9);
    return flow;
}

Flow Flow::between(std::vector<Point> from, std::vector<Point> to) {
    Flow flow;
    flow.from_ = std::move(from);
    flow.to_ = std::move(to);
    std::vector<double> nearest;
    for (const Point& a : flow.from_) {
        double minimum = 1e9;
        for (const Point& b : flow.from_)
            if (&a != &b) minimum = std::min(minimum, std::hypot(a.x - b.x, a.y - b.y));
        nearest.push_back(minimum);
    }
    if (nearest.size() < kNeighbours) return flow;
    flow.reach_ = 1.7 * median(std::move(nearest));
    return flow;
}

std::optional<Point> Flow::operator()(Point pixel) const {
    if (!homography_.empty()) {
        const double* h = homography_.data();
        const double w = h[6] * pixel.x + h[7] * pixel.y + h[8];
        return Point{(h[0] * pixel.x + h[1] * pixel.y + h[2]) / w,
                     (h[3] * pixel.x + h[4] * pixel.y + h[5]) / w};
    }
    if (from_.size() < kNeighbours) return std::nullopt;
    std::vector<std::pair<double, size_t>> near;
    for (size_t i = 0; i < from_.size(); ++i)
        near.emplace_back(std::hypot(from_[i].x - pixel.x, from_[i].y - pixel.y), i);
    std::partial_sort(near.begin(), near.begin() + kNeighbours, near.end());
    if (near[2].first > reach_) return std::nullopt;
    const double sigma = 0.8 * near[2].first + 1;
    Eigen::Matrix3d normal = Eigen::Vector3d(0, 1e-2, 1e-2).asDiagonal();
    Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
    for (size_t k = 0; k < kNeighbours; ++k) {
        const size_t i = near[k].second;
        const double weight = std::exp(-near[k].first * near[k].first / (2 * sigma * sigma));
        const Eigen::Vector3d row(1, from_[i].x - pixel.x, from_[i].y - pixel.y);
        normal += weight * row * row.transpose();
        right += weight * row * Eigen::RowVector2d(to_[i].x - from_[i].x, to_[i].y - from_[i].y);
    }
    const Eigen::Matrix<double, 3, 2> fit = normal.ldlt().solve(right);
    return Point{pixel.x + fit(0, 0), pixel.y + fit(0, 1)};
}

std::vector<ImagePair> load_scene(const std::string& folder, const std::string& name,
                                  const std::vector<size_t>& frames) {
    std::vector<std::string> files;
    if (!std::filesystem::is_directory(folder + "/left")) return {};
    for (const auto& entry : std::filesystem::directory_iterator(folder + "/left"))
        if (entry.path().extension() == ".png") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    if (files.empty()) return {};
    const GrayImage first = read_image(files[0]);
    const Camera camera =
        read_camera(folder + "/calibration.yaml", cv::Size(int(first.width), int(first.height)));
    const std::map<int, Point> points = read_points(folder + "/points.csv");
    Truth truth = read_truth(folder + "/truth.csv");
    check_agreement(folder, camera, points, truth[0]);

    std::vector<ImagePair> pairs;
    for (const size_t frame : frames) {
        if (frame >= files.size()) continue;
        std::vector<Point> from, to;
        for (const auto& [id, point] : points)
            if (const auto found = truth[frame].find(id);
                found != truth[frame].end() && found->second.visible) {
                from.push_back(point);
                to.push_back(camera.project(found->second.point));
            }
        if (from.size() < kNeighbours) continue;
        pairs.push_back({name, first, read_image(files[frame]), Flow::between(from, to)});
    }
    return pairs;
}

std::vector<ImagePair> load_pair(const std::string& first, const std::string& second,
                                 const std::string& homography, const std::string& name) {
    if (!std::filesystem::exists(first)) return {};
    std::optional<Flow> flow;
    if (!homography.empty()) {
        cv::Mat h;
        cv::FileStorage(homography, cv::FileStorage::READ)["H13"] >> h;
        if (h.rows != 3 || h.cols != 3)
            throw std::runtime_error(homography + ": no 3 x 3 matrix H13");
        h.convertTo(h, CV_64F);
        double row_major[9];
        std::copy_n(h.ptr<double>(), 9, row_major);
        flow = Flow::homography(row_major);
    }
    return {{name, read_image(first), read_image(second), flow}};
}

}  // namespace defrec::benchmarks
