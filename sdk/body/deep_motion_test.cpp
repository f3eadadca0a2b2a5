// Rigid motions of points that partly deform, and of a body that is partly pressed.
#include "sdk/body/deep_motion.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <numbers>
#include <vector>

using namespace defrec;
using Eigen::Isometry3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

constexpr Eigen::Index kCount = 120;

// A patch of a bowl, 72 x 60 mm.
Matrix3Xd patch() {
    Matrix3Xd points(3, kCount);
    for (Eigen::Index i = 0; i < kCount; ++i) {
        const double x = 6.0 * static_cast<double>(i % 12) - 33,
                     y = 6.0 * static_cast<double>(i / 12) - 27;
        points.col(i) = Vector3d(x, y, 90 + 0.004 * (x * x + y * y));
    }
    return points;
}

Isometry3d motion_of(double angle, const Vector3d& axis, const Vector3d& shift) {
    Isometry3d motion = Isometry3d::Identity();
    motion.linear() = Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
    motion.translation() = shift;
    return motion;
}

Isometry3d large_motion() { return motion_of(1.9, {0.3, -1, 0.5}, {40, -12, 25}); }

// Where the two motions differ most on the patch, mm.
double difference(const Isometry3d& a, const Isometry3d& b) {
    return (a * patch() - b * patch()).colwise().norm().maxCoeff();
}

// Points that are somewhere else: so many of ten.
Matrix3Xd with_outliers(const Matrix3Xd& points, int of_ten) {
    Matrix3Xd off = points;
    for (Eigen::Index i = 0; i < kCount; ++i)
        if (i * 7 % 10 < of_ten)
            off.col(i) += Vector3d(6 + std::sin(3.0 * static_cast<double>(i)), -5,
                                   8 * std::cos(static_cast<double>(i)));
    return off;
}

SmallMotion small_motion() {
    SmallMotion motion;
    motion << 0.4, -0.3, 0.7, 0.002, -0.003, 0.004;
    return motion;
}

}  // namespace

TEST_CASE("fit_rigid gives a motion as it is, however large, and a reflection as a motion") {
    const Matrix3Xd points = patch();
    const VectorXd weight = VectorXd::Ones(kCount);
    for (const double angle : {0.0, 1e-6, 0.5, 1.9, std::numbers::pi}) {
        const Isometry3d motion = motion_of(angle, {0.3, -1, 0.5}, {40, -12, 25});
        CHECK(difference(fit_rigid(points, motion * points, weight), motion) < 1e-9);
    }
    Matrix3Xd mirrored = points;
    mirrored.row(0) *= -1;
    const Isometry3d found = fit_rigid(points, mirrored, weight);
    CHECK(std::abs(found.linear().determinant() - 1) < 1e-9);
    // Flat points do not say on which side a point beside them is, a rotation does.
    Matrix3Xd flat = points;
    flat.row(2).setConstant(90);
    const Isometry3d turned = fit_rigid(flat, large_motion() * flat, weight);
    CHECK((turned.matrix() - large_motion().matrix()).norm() < 1e-9);
}

TEST_CASE("fit_rigid counts points by their weight") {
    const Matrix3Xd points = patch();
    Matrix3Xd moved = large_motion() * points;
    VectorXd weight = VectorXd::Constant(kCount, 0.3);
    for (Eigen::Index i = 0; i < kCount; i += 2) {
        moved.col(i) += Vector3d(1e3, 5, -7);
        weight[i] = 0;
    }
    CHECK(difference(fit_rigid(points, moved, weight), large_motion()) < 1e-9);
    const Isometry3d none = fit_rigid(points, moved, VectorXd::Zero(kCount));
    CHECK(none.matrix().allFinite());
}

TEST_CASE("fit_rigid_robust gives the motion of those that move alike") {
    const Matrix3Xd points = patch(), moved = large_motion() * points;
    const VectorXd weight = VectorXd::Ones(kCount);
    CHECK(difference(fit_rigid_robust(points, moved, weight, 0.15), large_motion()) < 1e-6);
    const Matrix3Xd off = with_outliers(moved, 4);
    CHECK(difference(fit_rigid(points, off, weight), large_motion()) > 2);
    CHECK(difference(fit_rigid_robust(points, off, weight, 0.15), large_motion()) < 0.02);
    // Outliers of weight 0 are none, even where they are the most.
    VectorXd known = weight;
    const Matrix3Xd most = with_outliers(moved, 8);
    for (Eigen::Index i = 0; i < kCount; ++i)
        if (most.col(i) != moved.col(i)) known[i] = 0;
    CHECK(difference(fit_rigid_robust(points, most, known, 0.15), large_motion()) < 1e-6);
}

TEST_CASE("small motions and their slopes agree to first order") {
    const Matrix3Xd points = patch();
    const Matrix3Xd moved = as_motion(small_motion()) * points - points;
    const VectorXd by_slope = motion_slope(points) * small_motion();
    const VectorXd moved_now = Eigen::Map<const VectorXd>(moved.data(), moved.size());
    // 0.005 rad squared times 100 mm.
    CHECK((by_slope - moved_now).cwiseAbs().maxCoeff() < 0.003);
    CHECK(by_slope.cwiseAbs().maxCoeff() > 0.5);
    CHECK((as_motion(SmallMotion::Zero()).matrix() - Eigen::Matrix4d::Identity()).norm() == 0);
    SmallMotion turn = SmallMotion::Zero();
    turn[5] = std::numbers::pi / 2;
    CHECK((as_motion(turn) * Vector3d(1, 0, 0) - Vector3d(0, 1, 0)).norm() < 1e-12);
}

TEST_CASE("sparsest gives the motion under which the fewest points have residuals") {
    const Matrix3Xd points = patch();
    const VectorXd weight = VectorXd::Ones(kCount);
    HandleResiduals kind;
    kind.slope = motion_slope(points);
    kind.floor = 0.04;
    kind.values = kind.slope * small_motion();
    CHECK((sparsest({&kind, 1}, weight, {}) - small_motion()).norm() < 1e-6);
    // A load on a third of the points, and a pull at its rim.
    for (Eigen::Index i = 0; i < kCount; ++i)
        if (points.col(i).x() > 12) kind.values.segment<3>(3 * i) += Vector3d(0.5, 0, 7);
    const Isometry3d found = as_motion(sparsest({&kind, 1}, weight, {}));
    CHECK(difference(found, as_motion(small_motion())) < 0.01);
    const SmallMotion mean = kind.slope.colPivHouseholderQr().solve(kind.values);
    CHECK(difference(as_motion(mean), as_motion(small_motion())) > 1);
    // The load has no weight: then nothing is left of it.
    VectorXd known = weight;
    for (Eigen::Index i = 0; i < kCount; ++i)
        if (points.col(i).x() > 12) known[i] = 0;
    CHECK((sparsest({&kind, 1}, known, {}) - small_motion()).norm() < 1e-6);
}

TEST_CASE(
    "sparsest takes kinds by their share, and what is known beforehand where all else is silent") {
    const Matrix3Xd points = patch();
    const VectorXd weight = VectorXd::Ones(kCount);
    std::vector<HandleResiduals> kinds(2);
    for (HandleResiduals& kind : kinds) {
        kind.slope = motion_slope(points);
        kind.floor = 0.04;
        kind.values = kind.slope * small_motion();
    }
    kinds[1].values *= -1;
    kinds[1].share = 0;
    CHECK((sparsest(kinds, weight, {}) - small_motion()).norm() < 1e-6);
    kinds[0].share = 0;
    kinds[1].share = 1;
    CHECK((sparsest(kinds, weight, {}) + small_motion()).norm() < 1e-6);
    // Nothing is known at all.
    CHECK(sparsest(kinds, VectorXd::Zero(kCount), {}).norm() == 0);

    const Isometry3d estimate = large_motion(), expected = estimate * as_motion(small_motion());
    const Vector3d centre = points.rowwise().mean();
    const MotionPrior prior = camera_prior(estimate, expected, centre);
    const SmallMotion found = sparsest(kinds, VectorXd::Zero(kCount), prior);
    CHECK(difference(estimate * as_motion(found), expected) < 1e-6);
    // Points that are sure count more than the camera.
    CHECK(difference(as_motion(sparsest(kinds, weight, prior)), as_motion(-small_motion())) < 0.01);
}

TEST_CASE("the size of residuals is that of half of the weight") {
    VectorXd values(9), weight(3);
    values << 1, 0, 0, 0, 3, 4, 0, 0, 40;
    weight << 1, 1, 1;
    CHECK(std::abs(median_size(values, weight) - 5) < 1e-3);
    weight << 3, 1, 1;
    CHECK(std::abs(median_size(values, weight) - 1) < 1e-3);
    weight << 1, 1, 3;
    CHECK(std::abs(median_size(values, weight) - 40) < 1e-3);
}

TEST_CASE("of no points the median is 0, and the motion is none") {
    CHECK(median_size(VectorXd(), VectorXd()) == 0);
    const Matrix3Xd points(3, 0);
    CHECK(fit_rigid_robust(points, points, VectorXd(), 0.15).isApprox(Isometry3d::Identity()));
}

TEST_CASE("points in a row turn with it, and not about it") {
    for (const double across : {0.0, 0.05, 0.3}) {
        CAPTURE(across);
        Eigen::Matrix3Xd row(3, 9);
        for (Eigen::Index i = 0; i < row.cols(); ++i)
            row.col(i) = Vector3d(6.0 * static_cast<double>(i), i % 2 != 0 ? across : 0, 80);
        const Isometry3d turned =
            Eigen::Translation3d(3, -1, 4) * Eigen::AngleAxisd(0.1, Vector3d(0, 1, 1).normalized());
        Eigen::Matrix3Xd now = turned * row;
        for (Eigen::Index i = 0; i < now.cols(); ++i) now(2, i) += i % 3 == 0 ? 0.05 : -0.03;
        const Eigen::VectorXd weight = Eigen::VectorXd::Ones(row.cols());
        const Vector3d deep(24, 0, 100);
        CHECK((fit_rigid(row, now, weight) * deep - turned * deep).norm() < 2.5);
        CHECK((fit_rigid_robust(row, now, weight, 0.15) * deep - turned * deep).norm() < 2.5);
    }
}
