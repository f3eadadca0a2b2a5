// For tests: a rendered sequence read back from its files, with OpenCV as the independent judge of
// geometry.
#pragma once

#include <doctest/doctest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "sdk/base/util/median.hpp"
#include "sdk/scenes/writing/render_command.hpp"

namespace defrec::cli {

/// A folder that goes when the test ends.
struct TemporaryFolder {
    std::filesystem::path path;
    TemporaryFolder() {
        static int count = 0;
        path = std::filesystem::temp_directory_path() /
               ("defrec_render_test_" + std::to_string(getpid()) + "_" + std::to_string(count++));
        std::filesystem::create_directories(path);
    }
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
};

struct TruthRow {
    cv::Point3d point;
    bool visible = false;
};

inline std::string slurp(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
}

inline std::string numbered(int frame) {
    char name[16];
    std::snprintf(name, sizeof name, "%06d.png", frame);
    return name;
}

/// A written sequence, read back as a stranger would read it.
struct Written {
    TemporaryFolder folder;
    cv::Mat m1, d1, m2, d2, r, t, r1, r2, p1, p2;
    cv::Size size;
    std::vector<cv::Point2d> points;
    std::vector<std::vector<TruthRow>> truth;  ///< frame, id

    /// out_dir is not heeded.
    explicit Written(RenderOptions options) {
        options.out_dir = folder.path.string();
        render_sequence(options, {});
        read_calibration();
        read_tables(options.frames);
    }

    void read_calibration() {
        cv::FileStorage file((folder.path / "calibration.yaml").string(), cv::FileStorage::READ);
        file["M1"] >> m1;
        file["D1"] >> d1;
        file["M2"] >> m2;
        file["D2"] >> d2;
        file["R"] >> r;
        file["T"] >> t;
        size =
            cv::Size(static_cast<int>(file["image_width"]), static_cast<int>(file["image_height"]));
        cv::Mat q;
        cv::stereoRectify(m1, d1, m2, d2, size, r, t, r1, r2, p1, p2, q, cv::CALIB_ZERO_DISPARITY,
                          0);
    }

    void read_tables(int frames) {
        std::ifstream pixels(folder.path / "points.csv");
        std::string line;
        REQUIRE(std::getline(pixels, line));
        REQUIRE(line == "id,u,v");
        int id = 0, frame = 0, visible = 0;
        double x = 0, y = 0, z = 0;
        while (std::getline(pixels, line)) {
            REQUIRE(std::sscanf(line.c_str(), "%d,%lf,%lf", &id, &x, &y) == 3);
            REQUIRE(id == static_cast<int>(points.size()));
            points.emplace_back(x, y);
        }
        truth.assign(static_cast<std::size_t>(frames), std::vector<TruthRow>(points.size()));
        std::ifstream rows(folder.path / "truth.csv");
        REQUIRE(std::getline(rows, line));
        REQUIRE(line == "frame,id,x,y,z,visible");
        std::size_t count = 0;
        for (; std::getline(rows, line); ++count) {
            REQUIRE(std::sscanf(line.c_str(), "%d,%d,%lf,%lf,%lf,%d", &frame, &id, &x, &y, &z,
                                &visible) == 6);
            truth.at(static_cast<std::size_t>(frame)).at(static_cast<std::size_t>(id)) = {
                {x, y, z}, visible != 0};
        }
        REQUIRE(count == truth.size() * points.size());
    }

    cv::Mat image(const char* view, int frame) const {
        const cv::Mat picture =
            cv::imread((folder.path / view / numbered(frame)).string(), cv::IMREAD_COLOR);
        REQUIRE(picture.size() == size);
        return picture;
    }

    cv::Mat rectified(const char* view, int frame) const {
        const bool left = std::string(view) == "left";
        cv::Mat x, y, gray, result;
        cv::initUndistortRectifyMap(left ? m1 : m2, left ? d1 : d2, left ? r1 : r2, left ? p1 : p2,
                                    size, CV_32FC1, x, y);
        cv::cvtColor(image(view, frame), gray, cv::COLOR_BGR2GRAY);
        cv::remap(gray, result, x, y, cv::INTER_LINEAR);
        return result;
    }

    /// Pixel in the rectified left image, and disparity, of a point in the left rectified camera.
    cv::Point3d in_rectified(const cv::Point3d& p) const {
        const double f = p1.at<double>(0, 0);
        return {f * p.x / p.z + p1.at<double>(0, 2), f * p.y / p.z + p1.at<double>(1, 2),
                -p2.at<double>(0, 3) / p.z};
    }

    /// Pixel in the left image as given.
    cv::Point2d in_raw(const cv::Point3d& p) const {
        const cv::Mat rectified_point = (cv::Mat_<double>(3, 1) << p.x, p.y, p.z);
        const cv::Mat raw = r1.t() * rectified_point;
        std::vector<cv::Point2d> pixel;
        cv::projectPoints(raw.reshape(3, 1), cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0), m1, d1, pixel);
        return pixel[0];
    }
};

inline double median(std::vector<double> values) {
    REQUIRE(!values.empty());
    return defrec::median(std::move(values));
}

/// Where, within `reach` px of `expected`, a patch of `from` round `centre` is found in `to`:
/// offset from expected, with sub-pixel parabola. False near the border and where the best match is
/// poor.
inline bool match(const cv::Mat& from, cv::Point2d centre, const cv::Mat& to, cv::Point2d expected,
                  int reach, cv::Point2d& offset) {
    constexpr int kHalf = 10;
    const int margin = kHalf + reach + 2;
    const cv::Rect2d inner(margin, margin, from.cols - 2 * margin, from.rows - 2 * margin);
    if (!inner.contains(centre) || !inner.contains(expected)) {
        return false;
    }
    cv::Mat patch, area, score;
    cv::getRectSubPix(from, {2 * kHalf + 1, 2 * kHalf + 1}, cv::Point2f(centre), patch);
    cv::getRectSubPix(to, {2 * (kHalf + reach) + 1, 2 * (kHalf + reach) + 1}, cv::Point2f(expected),
                      area);
    cv::matchTemplate(area, patch, score, cv::TM_CCOEFF_NORMED);
    double best = 0;
    cv::Point at;
    cv::minMaxLoc(score, nullptr, &best, nullptr, &at);
    offset = {at.x - static_cast<double>(reach), at.y - static_cast<double>(reach)};
    if (best < 0.6) {
        return false;
    }
    const auto refine = [](double before, double here, double after) {
        const double curvature = before - 2 * here + after;
        return curvature < 0 ? 0.5 * (before - after) / curvature : 0.0;
    };
    if (at.x > 0 && at.x + 1 < score.cols && at.y > 0 && at.y + 1 < score.rows) {
        const auto s = [&](int dx, int dy) {
            return static_cast<double>(score.at<float>(at.y + dy, at.x + dx));
        };
        offset.x += refine(s(-1, 0), s(0, 0), s(1, 0));
        offset.y += refine(s(0, -1), s(0, 0), s(0, 1));
    }
    return true;
}

}  // namespace defrec::cli
