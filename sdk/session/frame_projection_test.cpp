// Projection into the left image as given, against OpenCV's on the same camera.
#include "sdk/session/frame_projection.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <vector>

using namespace defrec::cli;

namespace {

StereoCalibration toed_in_rig() {
    StereoCalibration calibration;
    calibration.width = 640;
    calibration.height = 480;
    calibration.left = {
        620, 622, 318, 243, {-0.21, 0.08, 1e-3, -5e-4, 0}, "left camera", "left distortion"};
    calibration.right = {
        618, 621, 325, 238, {-0.20, 0.07, 0, 1e-3, 0}, "right camera", "right distortion"};
    cv::Matx33d rotation;
    cv::Rodrigues(cv::Vec3d(0.01, -0.03, 0.008), rotation);
    std::copy(rotation.val, rotation.val + 9, calibration.rotation.begin());
    calibration.translation = {-5.2, 0.1, -0.05};
    return calibration;
}

}  // namespace

TEST_CASE("points of the rectified camera land where OpenCV projects them in the raw image") {
    const StereoCalibration calibration = toed_in_rig();
    const Context context = open_context({1, true, {}});
    const Rig rig = make_rig(context, calibration);
    RawProjection projection(rig);
    const defrec_rig_info info = rig_info(rig);
    CHECK(info.identity == 0);

    std::vector<double> xyz;
    for (const double z : {60.0, 90.0}) {
        for (const double y : {-15.0, 0.0, 15.0}) {
            for (const double x : {-18.0, 2.0, 18.0}) xyz.insert(xyz.end(), {x, y, z});
        }
    }
    const std::size_t count = xyz.size() / 3;
    std::vector<double> uv(2 * count);
    projection.project(xyz.data(), count, uv.data());

    const cv::Matx33d to_rectified(info.rotation);
    std::vector<cv::Point3d> raw;
    for (std::size_t i = 0; i < count; ++i) {
        const cv::Vec3d point =
            to_rectified.t() * cv::Vec3d(xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]);
        raw.emplace_back(point);
    }
    const CameraCalibration& left = calibration.left;
    const cv::Matx33d camera(left.fx, 0, left.cx, 0, left.fy, left.cy, 0, 0, 1);
    std::vector<cv::Point2d> expected;
    cv::projectPoints(raw, cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0), camera, left.distortion,
                      expected);
    for (std::size_t i = 0; i < count; ++i) {
        CHECK(uv[2 * i] == doctest::Approx(expected[i].x).epsilon(1e-6));
        CHECK(uv[2 * i + 1] == doctest::Approx(expected[i].y).epsilon(1e-6));
    }
}

TEST_CASE("what cannot be projected is NaN and disturbs no other point") {
    const Context context = open_context({1, true, {}});
    const Rig rig = make_rig(context, toed_in_rig());
    RawProjection projection(rig);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float xyz[] = {0, 0, -80, nan, 0, 80, 1, 2, 80, 0, 0, 0};
    float uv[8], alone[2];
    projection.project(xyz, 4, uv);
    projection.project(xyz + 6, 1, alone);
    CHECK(std::isnan(uv[0]));
    CHECK(std::isnan(uv[3]));
    CHECK(uv[4] == alone[0]);
    CHECK(uv[5] == alone[1]);
    CHECK(std::isnan(uv[6]));
    projection.project(xyz, 0, uv);
}
