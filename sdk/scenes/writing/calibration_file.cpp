// A rig in OpenCV's terms.
#include "sdk/scenes/writing/calibration_file.hpp"

#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "sdk/base/os/atomic_file.hpp"

namespace defrec::cli {
namespace {

cv::Mat camera_matrix(const Lens& lens) {
    return (cv::Mat_<double>(3, 3) << lens.fx, 0, lens.cx, 0, lens.fy, lens.cy, 0, 0, 1);
}

cv::Mat coefficients(const Lens& lens) {
    return cv::Mat(1, 5, CV_64F, const_cast<double*>(lens.distortion.data())).clone();
}

void write_matrices(const StereoRig& rig, cv::FileStorage& file) {
    cv::Mat r, t;
    cv::eigen2cv(rig.rotation, r);
    cv::eigen2cv(rig.translation, t);
    file << "M1" << camera_matrix(rig.left) << "D1" << coefficients(rig.left) << "M2"
         << camera_matrix(rig.right) << "D2" << coefficients(rig.right) << "R" << r << "T" << t;
}

/// In memory first: OpenCV's own writer does not report a full disk.
cv::FileStorage new_yaml() { return {".yaml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY}; }

}  // namespace

RectifiedViews rectified_views(const StereoRig& rig) {
    cv::Mat r, t, r1, r2, p1, p2, q;
    cv::eigen2cv(rig.rotation, r);
    cv::eigen2cv(rig.translation, t);
    cv::stereoRectify(camera_matrix(rig.left), coefficients(rig.left), camera_matrix(rig.right),
                      coefficients(rig.right), cv::Size(rig.width, rig.height), r, t, r1, r2, p1,
                      p2, q, cv::CALIB_ZERO_DISPARITY, 0);
    RectifiedViews views;
    cv::cv2eigen(r1, views.rotation);
    cv::cv2eigen(p1, views.left);
    cv::cv2eigen(p2, views.right);
    return views;
}

Eigen::Matrix3d rectification(const StereoRig& rig) { return rectified_views(rig).rotation; }

void write_calibration(const StereoRig& rig, const std::string& path) {
    cv::FileStorage file = new_yaml();
    file << "image_width" << rig.width << "image_height" << rig.height;
    write_matrices(rig, file);
    write_atomically(path, file.releaseAndGetString());
}

void write_stereo_calibration(const StereoRig& rig, const std::string& path) {
    cv::FileStorage file = new_yaml();
    write_matrices(rig, file);
    write_atomically(path, file.releaseAndGetString());
}

}  // namespace defrec::cli
