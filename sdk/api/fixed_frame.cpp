// Results of a frame in the fixed frame of its camera's pose.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "sdk/api/call.hpp"
#include "sdk/api/job_use.hpp"
#include "sdk/api/read.hpp"
#include "sdk/registration/pose.hpp"

using namespace defrec;

namespace {

// values: 6x6 row-major; null: all zero.
TwistMatrix read_pose_covariance(const double* values) {
    // Correlations that are derived from others are off by rounding.
    constexpr double kTolerance = 1e-6;
    if (values == nullptr) return TwistMatrix::Zero();
    const TwistMatrix given =
        Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(values);
    const Twist variances = given.diagonal();
    if (!given.allFinite() || variances.minCoeff() < 0)
        fail(DEFREC_ERROR_ARGUMENT,
             "pose_covariance has a variance below 0, or a number that is not finite");
    const Twist scale = variances.unaryExpr(
        [](double variance) { return variance > 0 ? 1 / std::sqrt(variance) : 1; });
    const TwistMatrix correlations = scale.asDiagonal() * given * scale.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<TwistMatrix> solver(correlations, Eigen::EigenvaluesOnly);
    if ((correlations - correlations.transpose()).cwiseAbs().maxCoeff() > kTolerance ||
        solver.eigenvalues().minCoeff() < -kTolerance)
        fail(DEFREC_ERROR_ARGUMENT,
             "pose_covariance is no covariance: it is not symmetric, or "
             "some combination of errors has a variance below 0");
    return given;
}

}  // namespace

extern "C" {

defrec_status defrec_job_to_fixed_frame(defrec_job job, const double* pose_covariance, size_t count,
                                        const double* camera_xyz, const double* camera_covariance,
                                        double* xyz, double* covariance) {
    return api_call([&] {
        const JobUse use(job);
        check_count(count);
        const std::optional<Eigen::Isometry3d>& pose = use.camera_pose();
        if (!pose)
            fail(DEFREC_ERROR_STATE,
                 "this frame was submitted without DEFREC_FRAME_CAMERA_POSE and its camera_pose");
        const TwistMatrix pose_error = read_pose_covariance(pose_covariance);
        const std::span<const double> places = read_array("camera_xyz", camera_xyz, count, 3);
        if (count != 0) expect_given("xyz", xyz);
        const Eigen::Matrix3d rotation = pose->rotation();
        for (size_t i = 0; i < count; ++i) {
            const Eigen::Vector3d turned = rotation * Eigen::Vector3d(places.data() + 3 * i);
            Eigen::Vector3d::Map(xyz + 3 * i) = turned + pose->translation();
            if (covariance == nullptr) continue;
            // About the camera's place.
            const Eigen::Matrix<double, 3, 6> moved = place_shift(turned);
            Eigen::Matrix3d error = moved * pose_error * moved.transpose();
            if (camera_covariance != nullptr)
                error +=
                    rotation * symmetric_matrix(camera_covariance + 6 * i) * rotation.transpose();
            std::ranges::copy(symmetric_values(error), covariance + 6 * i);
        }
    });
}

}  // extern "C"
