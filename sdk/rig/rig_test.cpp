#include "sdk/rig/rig.hpp"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <random>
#include <string>

#include "sdk/base/util/error.hpp"

using namespace defrec;

namespace {

std::shared_ptr<const Services> services(uint32_t threads = 1) {
    defrec_context_desc desc{};
    desc.threads = threads;
    return std::make_shared<const Services>(desc);
}

// Whose warnings are appended to the log, which outlives them.
std::shared_ptr<const Services> logging_into(std::string& log) {
    defrec_context_desc desc{};
    desc.threads = 1;
    desc.log_level = DEFREC_LOG_WARNING;
    desc.log_user = &log;
    desc.log = [](void* user, int32_t, const char*, const char* text) {
        static_cast<std::string*>(user)->append(text).append("\n");
    };
    return std::make_shared<const Services>(desc);
}

// A stereo endoscope, 4.6 mm between views that look inwards a little.
defrec_rig_desc endoscope(uint32_t distortion_count = 5) {
    defrec_rig_desc desc{};
    desc.struct_size = sizeof desc;
    desc.width = 161;
    desc.height = 119;
    desc.left = {170,
                 171,
                 81.5,
                 60.25,
                 {-0.31, 0.12, 0.001, -0.0007, -0.02, 0.01, 0.02, 0.003, 0.002, -0.001, 0.0015,
                  0.001, 0.02, -0.03},
                 distortion_count,
                 0};
    desc.right = {168,
                  169.5,
                  78.25,
                  58.5,
                  {-0.28, 0.10, -0.0012, 0.0004, 0.01, 0.02, -0.01, 0.002, -0.001, 0.002, 0.001,
                   -0.002, -0.01, 0.02},
                  distortion_count,
                  0};
    const Eigen::Matrix3d turn = (Eigen::AngleAxisd(0.05, Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitX()) *
                                  Eigen::AngleAxisd(-0.02, Eigen::Vector3d::UnitZ()))
                                     .toRotationMatrix();
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(desc.rotation) = turn;
    desc.translation[0] = -4.6;
    desc.translation[1] = 0.1;
    desc.translation[2] = 0.2;
    return desc;
}

defrec_rig_desc rectified() {
    defrec_rig_desc desc = endoscope(0);
    desc.left = desc.right = {170, 170, 80, 59, {}, 0, 0};
    Eigen::Map<Eigen::Matrix3d>(desc.rotation).setIdentity();
    desc.translation[1] = desc.translation[2] = 0;
    return desc;
}

cv::Mat camera_matrix(const defrec_intrinsics& c) {
    return (cv::Mat_<double>(3, 3) << c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1);
}
cv::Mat distortion(const defrec_intrinsics& c) {
    cv::Mat d = cv::Mat::zeros(1, std::max(4, int(c.distortion_count)), CV_64F);
    for (uint32_t i = 0; i < c.distortion_count; ++i) d.at<double>(int(i)) = c.distortion[i];
    return d;
}
const defrec_intrinsics& view_of(const defrec_rig_desc& desc, int view) {
    return view == 0 ? desc.left : desc.right;
}

cv::Mat to_cv(const Eigen::Matrix3d& m) {
    cv::Mat result(3, 3, CV_64F);
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) result.at<double>(r, c) = m(r, c);
    return result;
}
cv::Mat rectified_camera(const Rig& rig) {
    const defrec_camera& c = rig.camera();
    return (cv::Mat_<double>(3, 3) << c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1);
}

Error refusal(const std::function<void(defrec_rig_desc&)>& change) {
    defrec_rig_desc desc = endoscope();
    change(desc);
    try {
        const Rig rig(services(), desc);
    } catch (const Error& error) {
        return error;
    }
    return Error(DEFREC_OK, "");
}
void check_refused(const char* part, const std::function<void(defrec_rig_desc&)>& change,
                   defrec_status status = DEFREC_ERROR_ARGUMENT) {
    const Error error = refusal(change);
    INFO(error.what());
    CHECK(error.status() == status);
    CHECK(std::string(error.what()).find(part) != std::string::npos);
}

}  // namespace

TEST_CASE("the rectifying rotations are those of OpenCV's stereoRectify") {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> angle(-0.15, 0.15), offset(-0.3, 0.3);
    for (int i = 0; i < 50; ++i) {
        defrec_rig_desc desc = endoscope(0);
        const Eigen::Vector3d axis(angle(random), angle(random), angle(random));
        Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(desc.rotation) =
            Eigen::AngleAxisd(axis.norm(), axis.normalized()).toRotationMatrix();
        desc.translation[1] = offset(random);
        desc.translation[2] = offset(random);
        const Rig rig(services(), desc);
        cv::Mat r1, r2, p1, p2, q;
        cv::stereoRectify(camera_matrix(desc.left), distortion(desc.left),
                          camera_matrix(desc.right), distortion(desc.right), cv::Size(161, 119),
                          cv::Mat(3, 3, CV_64F, desc.rotation).clone(),
                          cv::Mat(3, 1, CV_64F, desc.translation).clone(), r1, r2, p1, p2, q);
        CHECK(cv::norm(r1 - to_cv(rig.rotation(0)), cv::NORM_INF) < 1e-9);
        CHECK(cv::norm(r2 - to_cv(rig.rotation(1)), cv::NORM_INF) < 1e-9);
        const Eigen::Map<const Eigen::Vector3d> t(desc.translation);
        CHECK(rig.camera().baseline_mm == doctest::Approx(t.norm()).epsilon(1e-12));
        CHECK((rig.rotation(1) * t - Eigen::Vector3d(-t.norm(), 0, 0)).norm() < 1e-9);
    }
}

TEST_CASE("the maps are OpenCV's initUndistortRectifyMap, for every number of coefficients") {
    for (const uint32_t count : {0u, 4u, 5u, 8u, 12u, 14u}) {
        CAPTURE(count);
        const defrec_rig_desc desc = endoscope(count);
        const Rig rig(services(2), desc);
        REQUIRE(!rig.identity());
        for (int view = 0; view < 2; ++view) {
            cv::Mat map_x, map_y;
            cv::initUndistortRectifyMap(camera_matrix(view_of(desc, view)),
                                        distortion(view_of(desc, view)), to_cv(rig.rotation(view)),
                                        rectified_camera(rig), cv::Size(161, 119), CV_32FC1, map_x,
                                        map_y);
            const int32_t* map = rig.map(view);
            int inside = 0;
            for (int y = 0; y < 119; ++y)
                for (int x = 0; x < 161; ++x, map += 2) {
                    const double u = map_x.at<float>(y, x), v = map_y.at<float>(y, x);
                    if (map[0] == std::numeric_limits<int32_t>::min()) {
                        const bool well_inside = u > 0.01 && v > 0.01 && u < 159.99 && v < 117.99;
                        REQUIRE_FALSE(well_inside);
                        REQUIRE(map[1] == std::numeric_limits<int32_t>::min());
                    } else {
                        REQUIRE(std::abs(map[0] / 128.0 - u) < 0.5 / 128 + 1e-4);
                        REQUIRE(std::abs(map[1] / 128.0 - v) < 0.5 / 128 + 1e-4);
                        ++inside;
                    }
                }
            CHECK(inside > 161 * 119 * 8 / 10);
        }
    }
}

TEST_CASE("rectified pixels are OpenCV's undistortPoints, and the way back returns") {
    for (const uint32_t count : {0u, 4u, 5u, 8u, 12u, 14u}) {
        CAPTURE(count);
        const defrec_rig_desc desc = endoscope(count);
        const Rig rig(services(), desc);
        for (int view = 0; view < 2; ++view) {
            std::vector<cv::Point2d> raw;
            for (int y = 0; y < 119; y += 13)
                for (int x = 0; x < 161; x += 16) raw.emplace_back(x + 0.25, y);
            std::vector<cv::Point2d> expected;
            cv::undistortPoints(
                raw, expected, camera_matrix(view_of(desc, view)), distortion(view_of(desc, view)),
                to_cv(rig.rotation(view)), rectified_camera(rig),
                cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 500, 1e-14));
            std::vector<double> uv(2 * raw.size());
            rig.rectify_pixels(view, &raw[0].x, raw.size(), uv.data());
            for (size_t i = 0; i < raw.size(); ++i) {
                CHECK(std::abs(uv[2 * i] - expected[i].x) < 1e-6);
                CHECK(std::abs(uv[2 * i + 1] - expected[i].y) < 1e-6);
            }
            rig.distort_pixels(view, uv.data(), raw.size(), uv.data());
            for (size_t i = 0; i < raw.size(); ++i) {
                CHECK(std::abs(uv[2 * i] - raw[i].x) < 1e-6);
                CHECK(std::abs(uv[2 * i + 1] - raw[i].y) < 1e-6);
            }
        }
    }
}

TEST_CASE(
    "a point in front of the rig falls onto the same row of both rectified images, at the "
    "disparity f B / Z") {
    const defrec_rig_desc desc = endoscope(14);
    const Rig rig(services(), desc);
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> turn(desc.rotation);
    const Eigen::Map<const Eigen::Vector3d> offset(desc.translation);
    const Eigen::Vector3d left(3, -2, 80), right = turn * left + offset;
    double uv[2][2];
    for (int view = 0; view < 2; ++view) {
        const Eigen::Vector3d& point = view == 0 ? left : right;
        std::vector<cv::Point2d> pixel;
        cv::projectPoints(std::vector<cv::Point3d>{{point.x(), point.y(), point.z()}},
                          cv::Mat::zeros(3, 1, CV_64F), cv::Mat::zeros(3, 1, CV_64F),
                          camera_matrix(view_of(desc, view)), distortion(view_of(desc, view)),
                          pixel);
        rig.rectify_pixels(view, &pixel[0].x, 1, uv[view]);
    }
    const double depth = (rig.rotation(0) * left).z();
    CHECK(uv[0][1] == doctest::Approx(uv[1][1]).epsilon(1e-9));
    CHECK(uv[0][0] - uv[1][0] ==
          doctest::Approx(rig.camera().fx * rig.camera().baseline_mm / depth).epsilon(1e-9));
}

// A stereo microscope: each camera turned inwards by half of the angle, or its sensor shifted
// outwards, so that both look at the same place `depth` mm away.
defrec_rig_desc microscope(double degrees, double shift_px, double depth = 300,
                           double focal = 650) {
    defrec_rig_desc desc{};
    desc.struct_size = sizeof desc;
    desc.width = 160;
    desc.height = 120;
    desc.left = {focal, focal, 79.5 - shift_px, 59.5, {}, 0, 0};
    desc.right = {focal, focal, 79.5 + shift_px, 59.5, {}, 0, 0};
    const double half = degrees * M_PI / 360;
    const double base = shift_px != 0 ? 2 * shift_px * depth / focal : 2 * depth * std::sin(half);
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(2 * half, Eigen::Vector3d::UnitY()).toRotationMatrix();
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(desc.rotation) = turn;
    // The left camera stands in the middle of a circle round the place; the right one on it.
    const Eigen::Vector3d centre(base * std::cos(half), 0, base * std::sin(half));
    Eigen::Map<Eigen::Vector3d>(desc.translation) = -turn * centre;
    return desc;
}

TEST_CASE("views that converge share what both see, and depth is f B / (d + offset)") {
    struct Case {
        double degrees, shift_px;
    };
    for (const Case& given : {Case{0, 25}, Case{0, 60}, Case{5, 0}, Case{12, 0}, Case{20, 0}}) {
        CAPTURE(given.degrees);
        CAPTURE(given.shift_px);
        const defrec_rig_desc desc = microscope(given.degrees, given.shift_px);
        const Rig rig(services(), desc);
        const defrec_camera& camera = rig.camera();
        CHECK(camera.disparity_offset_px > 16);
        const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> turn(desc.rotation);
        const Eigen::Map<const Eigen::Vector3d> offset(desc.translation);
        for (const double depth : {285.0, 300.0}) {
            // Along the axis between the views.
            const double half = given.degrees * M_PI / 360,
                         side = given.shift_px != 0 ? camera.baseline_mm / 2 : 0;
            const Eigen::Vector3d left(side + 3 * std::cos(half), -2, depth - 3 * std::sin(half)),
                right = turn * left + offset;
            double uv[2][2] = {{desc.left.fx * left.x() / left.z() + desc.left.cx,
                                desc.left.fy * left.y() / left.z() + desc.left.cy},
                               {desc.right.fx * right.x() / right.z() + desc.right.cx,
                                desc.right.fy * right.y() / right.z() + desc.right.cy}};
            for (int view = 0; view < 2; ++view) rig.rectify_pixels(view, uv[view], 1, uv[view]);
            const double disparity = uv[0][0] - uv[1][0], z = (rig.rotation(0) * left).z();
            CHECK(uv[0][1] == doctest::Approx(uv[1][1]).epsilon(1e-9));
            CHECK(disparity + camera.disparity_offset_px ==
                  doctest::Approx(camera.fx * camera.baseline_mm / z).epsilon(1e-9));
            // In the middle of both images, and found where stereo looks first.
            CHECK(disparity > 0);
            CHECK(disparity < 30);
            CHECK(std::abs(uv[0][0] - 80) < 15);
        }
    }
}

TEST_CASE("what lies behind the place where views meet, by a quarter of the field, has d >= 0") {
    // Images are 1920 px wide; disparities of 1,700 and 2,500 px are among the cases.
    struct Case {
        double degrees, shift_px, focal;
    };
    for (const Case& given : {Case{0, 850, 21250}, Case{0, 1250, 21250}, Case{12, 0, 11077},
                              Case{20, 0, 6857}, Case{20, 0, 7090}}) {
        CAPTURE(given.degrees);
        CAPTURE(given.shift_px);
        defrec_rig_desc desc = microscope(given.degrees, given.shift_px, 300, given.focal);
        desc.width = 1920;
        desc.height = 1080;
        for (defrec_intrinsics* camera : {&desc.left, &desc.right}) {
            camera->cx += 880;
            camera->cy += 480;
        }
        const Rig rig(services(), desc);
        const defrec_camera& camera = rig.camera();
        const double half = given.degrees * M_PI / 360;
        const double depth = 300 * std::cos(half), field = 1920 * depth / given.focal;
        const auto disparity = [&](double z) {
            return camera.fx * camera.baseline_mm / z - camera.disparity_offset_px;
        };
        CHECK(disparity(depth) > 0.029 * 1920);
        CHECK(disparity(depth) < 0.1 * 1920);
        CHECK(disparity(depth + 0.25 * field) >= 0);
    }
}

TEST_CASE("the rectified view keeps the scale and stays in the middle") {
    for (const uint32_t count : {0u, 5u, 14u}) {
        const Rig rig(services(), endoscope(count));
        CHECK(rig.camera().fx == rig.camera().fy);
        CHECK(rig.camera().fx == doctest::Approx(169.6).epsilon(0.01));
        const double middle[] = {80, 59};
        double left[2], right[2];
        rig.rectify_pixels(0, middle, 1, left);
        rig.rectify_pixels(1, middle, 1, right);
        CHECK(std::abs((left[0] + right[0]) / 2 - 80) < 6);
        CHECK(std::abs((left[1] + right[1]) / 2 - 59) < 6);
    }
}

TEST_CASE("cameras that are rectified already are used as they are") {
    const Rig rig(services(), rectified());
    CHECK(rig.identity());
    CHECK(rig.map(0) == nullptr);
    CHECK(rig.camera().cx == 80);
    CHECK(rig.camera().baseline_mm == 4.6);
    CHECK(rig.info().identity == 1);
    const double uv[] = {3.5, 7.25};
    double out[2];
    rig.rectify_pixels(0, uv, 1, out);
    CHECK(out[0] == 3.5);
    CHECK(out[1] == 7.25);
    defrec_rig_desc zeros = rectified();
    zeros.left.distortion_count = zeros.right.distortion_count = 5;
    CHECK(Rig(services(), zeros).identity());
    const std::function<void(defrec_rig_desc&)> changes[] = {
        [](auto& d) { d.left.fx += 0.01; }, [](auto& d) { d.right.cy += 0.01; },
        [](auto& d) { d.translation[1] = 0.01; },
        [](auto& d) { d.left.distortion_count = 4, d.left.distortion[0] = 0.01; }};
    for (const auto& change : changes) {
        defrec_rig_desc desc = rectified();
        change(desc);
        CHECK(!Rig(services(), desc).identity());
    }
}

TEST_CASE("the map of a right view that lies lower is the map of lower rows") {
    const Rig rig(services(), endoscope());
    const std::vector<int32_t> shifted = rig.shifted_right_map({.offset_px = 3});
    const size_t row = 2 * rig.width();
    for (size_t y = 0; y + 3 < rig.height(); ++y)
        for (size_t i = 0; i < row; ++i)
            REQUIRE(shifted[y * row + i] == rig.map(1)[(y + 3) * row + i]);
}

TEST_CASE("the map of a right view that is turned and enlarged, of a rectified pair") {
    const Rig rig(services(), rectified());
    const double roll = 0.01, ratio = 0.004;
    const std::vector<int32_t> map =
        rig.shifted_right_map({.offset_px = 1.5, .roll = roll, .ratio = ratio});
    const double cx = (rig.width() - 1.0) / 2, cy = (rig.height() - 1.0) / 2;
    for (const double x : {20.0, 80.0, 130.0})
        for (const double y : {20.0, 60.0, 100.0}) {
            const double u = x - roll * (y - cy) + ratio * (x - cx),
                         v = y + 1.5 + roll * (x - cx) + ratio * (y - cy);
            const size_t at = 2 * (static_cast<size_t>(y) * rig.width() + static_cast<size_t>(x));
            CHECK(std::abs(map[at] / 128.0 - u) <= 0.5 / 128 + 1e-9);
            CHECK(std::abs(map[at + 1] / 128.0 - v) <= 0.5 / 128 + 1e-9);
        }
}

TEST_CASE("row 108: the map of a right view that is turned to the side, of a rectified pair") {
    const Rig rig(services(), rectified());
    const double vergence = 0.02, f = rig.camera().fx;
    const std::vector<int32_t> map = rig.shifted_right_map({.vergence = vergence});
    for (const double x : {20.0, 80.0, 130.0})
        for (const double y : {20.0, 60.0, 100.0}) {
            const Eigen::Vector3d ray((x - rig.camera().cx) / f, (y - rig.camera().cy) / f, 1);
            const Eigen::Vector3d seen =
                Eigen::AngleAxisd(vergence, Eigen::Vector3d::UnitY()) * ray;
            const double u = rig.camera().cx + f * seen.x() / seen.z(),
                         v = rig.camera().cy + f * seen.y() / seen.z();
            const size_t at = 2 * (static_cast<size_t>(y) * rig.width() + static_cast<size_t>(x));
            CHECK(std::abs(map[at] / 128.0 - u) <= 0.5 / 128 + 1e-9);
            CHECK(std::abs(map[at + 1] / 128.0 - v) <= 0.5 / 128 + 1e-9);
            CHECK(u > x);
        }
}

TEST_CASE("pixels without an answer give NaN, not a guess") {
    const Rig rig(services(), endoscope());
    const double nothing[] = {std::nan(""), 3, 1e9, 1e9};
    double out[4];
    rig.rectify_pixels(0, nothing, 2, out);
    for (const double value : out) CHECK(std::isnan(value));
    rig.distort_pixels(0, nothing, 2, out);
    for (const double value : out) CHECK(std::isnan(value));
}

TEST_CASE("row 1: numbers that are not finite are refused by name") {
    const double bad[] = {std::nan(""), std::numeric_limits<double>::infinity(),
                          -std::numeric_limits<double>::infinity()};
    for (const double value : bad) {
        check_refused("left.fx", [&](auto& d) { d.left.fx = value; });
        check_refused("right.cy", [&](auto& d) { d.right.cy = value; });
        check_refused("right.distortion[2]", [&](auto& d) { d.right.distortion[2] = value; });
        check_refused("rotation", [&](auto& d) { d.rotation[4] = value; });
        check_refused("translation", [&](auto& d) { d.translation[2] = value; });
    }
}

TEST_CASE("row 2: focal lengths and principal points that cannot be are refused") {
    check_refused("left.fx is 0", [](auto& d) { d.left.fx = 0; });
    check_refused("right.fy is -170", [](auto& d) { d.right.fy = -170; });
    check_refused("left.fx is 0.01", [](auto& d) { d.left.fx = 0.01; });
    check_refused("left.cx is 5000", [](auto& d) { d.left.cx = 5000; });
    check_refused("right.cy is -900", [](auto& d) { d.right.cy = -900; });
}

TEST_CASE(
    "rows 10 and 109: a calibration that looks like one of images of another size is doubted") {
    const auto log_of = [](double scale, double off_x) {
        std::string log;
        defrec_rig_desc desc = endoscope(0);
        for (defrec_intrinsics* camera : {&desc.left, &desc.right}) {
            camera->fx *= scale;
            camera->fy *= scale;
            camera->cx *= scale;
            camera->cy *= scale;
        }
        desc.right.cx += off_x;
        const Rig rig(logging_into(log), desc);
        return log;
    };
    CHECK(log_of(1, 0).empty());
    CHECK(log_of(1, 50).empty());  // of rectified images
    CHECK(log_of(0.95, 0).empty());
    for (const double scale : {0.5, 0.75, 1.25, 2.0}) {
        const std::string log = log_of(scale, 0);
        CAPTURE(log);
        CHECK(log.find("left: the principal point (") != std::string::npos);
        CHECK(log.find("right: the principal point (") != std::string::npos);
        CHECK(log.find("another size") != std::string::npos);
    }
}

TEST_CASE(
    "row 109: focal lengths that differ along both sides, or between the views, are doubted") {
    const auto log_of = [](double fy, double right) {
        std::string log;
        defrec_rig_desc desc = endoscope(0);
        desc.left.fy *= fy;
        desc.right.fy *= fy * right;
        desc.right.fx *= right;
        const Rig rig(logging_into(log), desc);
        return log;
    };
    CHECK(log_of(1, 1).empty());
    CHECK(log_of(1.05, 1.05).empty());
    for (const double fy : {0.5, 0.85, 1.15, 1.5}) {
        const std::string log = log_of(fy, 1);
        CHECK(log.find("left: the focal lengths 170 and ") != std::string::npos);
        CHECK(log.find("right: the focal lengths ") != std::string::npos);
    }
    CHECK(log_of(1, 1.25).find("at the same zoom?") != std::string::npos);
}

TEST_CASE("row 109: focal lengths that are far apart are refused") {
    check_refused("left.fx is 12.8 px and left.fy 240000 px", [](auto& d) {
        d.width = 640;
        d.height = 480;
        d.left.fx = 12.8;  // 6.4 is too short by itself
        d.left.fy = 240000;
    });
    check_refused("right.fy 900 px", [](auto& d) { d.right.fy = 900; });
}

TEST_CASE("row 3: no baseline, and row 4: metres for millimetres") {
    check_refused("translation is 0",
                  [](auto& d) { d.translation[0] = d.translation[1] = d.translation[2] = 0; });
    check_refused("4.6 mm", [](auto& d) {
        d.translation[0] = -0.0046;
        d.translation[1] = d.translation[2] = 0;
    });
    check_refused("0.1 to 10000 expected", [](auto& d) {
        d.translation[0] = -0.0000046;  // mm or metres, it is too short
        d.translation[1] = d.translation[2] = 0;
    });
}

TEST_CASE("row 99: a baseline that no rig has, and cameras that look in different directions") {
    check_refused("the baseline is 1e+150 mm", [](auto& d) {
        d.translation[0] = -1e150;
        d.translation[1] = d.translation[2] = 0;
    });
    check_refused(
        "100 degrees apart",
        [](auto& d) {
            const double angle = 100 * 3.14159265358979 / 180;
            const double turned[9] = {std::cos(angle),  0, std::sin(angle), 0, 1, 0,
                                      -std::sin(angle), 0, std::cos(angle)};
            std::copy_n(turned, 9, d.rotation);
        },
        DEFREC_ERROR_UNSUPPORTED);
}

TEST_CASE("row 5: views swapped in the calibration") {
    check_refused("swapped", [](auto& d) { d.translation[0] = 4.6; });
}

TEST_CASE("row 7: a matrix that is no rotation is refused with the residual") {
    check_refused("differs from the identity by", [](auto& d) { d.rotation[0] *= 1.01; });
    check_refused("rotation", [](auto& d) {
        for (double& value : d.rotation) value = 0;
    });
    check_refused("determinant", [](auto& d) {
        for (double& value : d.rotation) value = -value;
    });
}

TEST_CASE("row 8: vertical and forward baselines are unsupported") {
    check_refused(
        "not horizontal", [](auto& d) { d.translation[0] = 0, d.translation[1] = -4.6; },
        DEFREC_ERROR_UNSUPPORTED);
    check_refused(
        "not horizontal", [](auto& d) { d.translation[0] = 0, d.translation[2] = 4.6; },
        DEFREC_ERROR_UNSUPPORTED);
    check_refused(
        " mm, 90 degrees",
        [](auto& d) {
            for (int i = 0; i < 9; ++i) d.rotation[i] = i % 4 == 0;
            d.translation[0] = d.translation[2] = 0, d.translation[1] = -4.6;
        },
        DEFREC_ERROR_UNSUPPORTED);
}

TEST_CASE("row 9: distortion of a wrong length, or not monotone inside the image") {
    for (const uint32_t count : {1u, 3u, 6u, 13u, 15u, UINT32_MAX})
        check_refused("distortion_count", [&](auto& d) { d.left.distortion_count = count; });
    check_refused("not monotone", [](auto& d) { d.left.distortion[0] = -3; });
    check_refused("not monotone", [](auto& d) { d.left.distortion[2] = 2; });
}

TEST_CASE("row 105: a distortion that folds at the corners is used up to the fold") {
    std::string log;
    const auto logging = logging_into(log);
    const auto pixels_beyond = [](const defrec_intrinsics& camera, double folds_at_px) {
        size_t beyond = 0;
        for (int y = 0; y < 119; ++y)
            for (int x = 0; x < 161; ++x)
                beyond += std::hypot(x - camera.cx, y - camera.cy) > folds_at_px;
        return static_cast<double>(beyond) / (161 * 119);
    };

    defrec_rig_desc desc = endoscope(8);
    // A published calibration: it folds at 0.804 from the axis, which is seen at 0.623.
    for (defrec_intrinsics* camera : {&desc.left, &desc.right})
        *camera = {120, 120, 80, 59, {-0.74, 2.93, 0, 0, -3.85, -0.30, 2.74, -3.85}, 8, 0};
    constexpr double kFold = 0.804, kFoldPx = 0.623 * 120;
    const Rig rig(logging, desc);
    INFO(log);
    CHECK(std::count(log.begin(), log.end(), '\n') == 2);
    for (const char* part : {"left.distortion", "right.distortion", "masked"})
        CHECK(log.find(part) != std::string::npos);
    const double share = std::stod(log.substr(log.find(": ") + 2)) / 100;
    CHECK(share == doctest::Approx(pixels_beyond(desc.left, kFoldPx)).epsilon(0.2));

    for (int view = 0; view < 2; ++view) {
        const int32_t* map = rig.map(view);
        size_t used = 0;
        for (int y = 0; y < 119; ++y)
            for (int x = 0; x < 161; ++x, map += 2) {
                const Eigen::Vector3d ray =
                    rig.rotation(view).transpose() *
                    Eigen::Vector3d((x - rig.camera().cx) / rig.camera().fx,
                                    (y - rig.camera().cy) / rig.camera().fy, 1);
                const bool is_used = map[0] != std::numeric_limits<int32_t>::min();
                used += is_used;
                if (ray.hnormalized().norm() > kFold) REQUIRE_FALSE(is_used);
                if (!is_used) continue;
                // Each direction has a pixel of its own.
                const double raw[2] = {map[0] / 128.0, map[1] / 128.0};
                double rectified[2];
                REQUIRE(std::hypot(raw[0] - 80, raw[1] - 59) < kFoldPx + 0.1);
                if (std::hypot(raw[0] - 80, raw[1] - 59) > kFoldPx - 2) continue;
                rig.rectify_pixels(view, raw, 1, rectified);
                REQUIRE(std::hypot(rectified[0] - x, rectified[1] - y) < 0.1);
            }
        CHECK(used > 161 * 119 / 2);
    }
    const double corner[] = {1, 1};
    double nothing[2];
    rig.rectify_pixels(0, corner, 1, nothing);
    CHECK(std::isnan(nothing[0]));

    // The middle of the image stays in the middle, whichever pixels have a direction.
    const double middle[] = {80, 59};
    double left[2], right[2];
    rig.rectify_pixels(0, middle, 1, left);
    rig.rectify_pixels(1, middle, 1, right);
    CHECK(std::abs((left[0] + right[0]) / 2 - 80) < 6);
    CHECK(std::abs((left[1] + right[1]) / 2 - 59) < 6);

    log.clear();
    desc.left.fx = desc.left.fy = desc.right.fx = desc.right.fy = 170;
    const Rig outside(logging, desc);
    CHECK(log.empty());
    check_refused("right.distortion is not monotone", [&](auto& d) {
        d.right = desc.right;
        d.right.fx = d.right.fy = 80;
    });
}

TEST_CASE("row 105: a distortion that folds to one side is masked on that side") {
    defrec_rig_desc desc = endoscope(4);
    for (defrec_intrinsics* camera : {&desc.left, &desc.right})
        *camera = {120, 120, 80, 59, {0, 0, 0.3}, 4, 0};
    const Rig rig(services(), desc);
    int used = 0;
    for (int y = 0; y < 119; ++y)
        for (int x = 0; x < 161; ++x) {
            const double rectified[2] = {double(x), double(y)};
            double raw[2], back[2];
            rig.distort_pixels(0, rectified, 1, raw);
            if (std::isnan(raw[0])) continue;
            rig.rectify_pixels(0, raw, 1, back);
            REQUIRE(std::hypot(back[0] - x, back[1] - y) < 1e-3);
            ++used;
        }
    CHECK(used > 161 * 119 / 2);
    const double top[] = {80, 5}, bottom[] = {80, 110};
    double out[2];
    rig.rectify_pixels(0, top, 1, out);
    CHECK(std::isnan(out[0]));
    rig.rectify_pixels(0, bottom, 1, out);
    CHECK_FALSE(std::isnan(out[0]));
}

TEST_CASE("row 21: sizes outside the limits, and flags") {
    check_refused("0 x 119", [](auto& d) { d.width = 0; });
    check_refused("161 x 47", [](auto& d) { d.height = 47; });
    check_refused("8193", [](auto& d) { d.width = 8193; });
    check_refused("flags", [](auto& d) { d.flags = 1; });
}

TEST_CASE("a place is seen where the map has its rectified pixel") {
    const Rig rig(services(), endoscope());
    const defrec_camera& camera = rig.camera();
    size_t seen = 0, beside = 0;
    for (int view : {0, 1})
        for (uint32_t y = 0; y < rig.height(); y += 7)
            for (uint32_t x = 0; x < rig.width(); x += 7) {
                constexpr double kDepth = 60;
                const double shift = view == 1 ? camera.baseline_mm : 0;
                const float place[3] = {
                    static_cast<float>((x - rig.principal_x(view)) * kDepth / camera.fx + shift),
                    static_cast<float>((y - camera.cy) * kDepth / camera.fy), kDepth};
                const auto rectified = rig.pixel_of(view, place, true);
                REQUIRE(rectified);
                CHECK(*rectified == Eigen::Vector2d(x, y));
                const double uv[] = {double(x), double(y)};
                double raw[2];
                rig.distort_pixels(view, uv, 1, raw);
                const auto found = rig.pixel_of(view, place, false);
                if (!found) {
                    ++beside;
                    continue;
                }
                ++seen;
                CHECK(std::hypot(found->x() - raw[0], found->y() - raw[1]) < 0.01);
            }
    CHECK(seen > 10 * beside);
    const float behind[] = {0, 0, -60}, far_aside[] = {600, 0, 60};
    CHECK_FALSE(rig.pixel_of(0, behind, true));
    CHECK_FALSE(rig.pixel_of(0, far_aside, true));
    const Rig identity(services(), rectified());
    const float middle[] = {0, 0, 60};
    CHECK(identity.pixel_of(0, middle, false) == identity.pixel_of(0, middle, true));
}
