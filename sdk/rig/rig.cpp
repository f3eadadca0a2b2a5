// See rig.hpp.
#include "sdk/rig/rig.hpp"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "backends/stages/rectify.hpp"
#include "sdk/base/util/error.hpp"
#include "sdk/rig/decisions.hpp"
#include "sdk/rig/rig_check.hpp"

namespace defrec {
namespace {

using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

bool same_cameras(const defrec_rig_desc& desc) {
    const auto &a = desc.left, &b = desc.right;
    return a.fx == b.fx && a.fy == b.fy && a.cx == b.cx && a.cy == b.cy;
}

bool rectified_already(const defrec_rig_desc& desc, const Lens& left, const Lens& right) {
    const Eigen::Map<const RowMajor> rotation(desc.rotation);
    const double* t = desc.translation;
    return !left.distorted() && !right.distorted() && same_cameras(desc) &&
           (rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-9 &&
           std::max(std::abs(t[1]), std::abs(t[2])) < 1e-9 * std::abs(t[0]);
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix) {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
    return svd.matrixU() * svd.matrixV().transpose();
}

}  // namespace

Rig::Rig(std::shared_ptr<const Services> services, const defrec_rig_desc& desc)
    : desc_((check_rig(*services, desc), desc)),
      lens_{Lens(desc.left, desc.width, desc.height), Lens(desc.right, desc.width, desc.height)},
      map_{ContextVector<int32_t>(services), ContextVector<int32_t>(services)},
      services_(std::move(services)) {
    rotation_.fill(Eigen::Matrix3d::Identity());
    identity_ = rectified_already(desc, lens_[0], lens_[1]);
    if (identity_) {
        camera_ = {desc.left.fx, desc.left.fy, desc.left.cx, desc.left.cy, -desc.translation[0], 0};
        return;
    }
    Services::forget_parallel_failure();
    rectify();
    choose_camera();
    for (int view = 0; view < 2; ++view) {
        map_[view].resize(2 * size_t{desc_.width} * desc_.height);
        fill_map(view, {}, map_[view].data());
    }
    Services::expect_parallel_success("computing the rectification");
}

// Bouguet's: each view turns by half the rotation between them, then both turn so that x runs along
// the baseline (J.-Y. Bouguet, Camera Calibration Toolbox; G. Bradski, A. Kaehler, Learning OpenCV,
// chapter 12).
void Rig::rectify() {
    const Eigen::AngleAxisd turn(nearest_rotation(Eigen::Map<const RowMajor>(desc_.rotation)));
    const Eigen::Matrix3d half =
        Eigen::AngleAxisd(-turn.angle() / 2, turn.axis()).toRotationMatrix();
    const Eigen::Vector3d baseline = half * Eigen::Map<const Eigen::Vector3d>(desc_.translation);
    const Eigen::Quaterniond to_axis =
        Eigen::Quaterniond::FromTwoVectors(baseline, -Eigen::Vector3d::UnitX());
    rotation_[0] = to_axis * half.transpose();
    rotation_[1] = to_axis * half;
}

// The scale of the raw images, and the middle of what both views see in the middle of the image.
// Views that converge see the same tissue where each has its own middle in the middle: they share
// no principal point (stereoRectify without CALIB_ZERO_DISPARITY).
void Rig::choose_camera() {
    const double f =
        std::pow(desc_.left.fx * desc_.left.fy * desc_.right.fx * desc_.right.fy, 0.25);
    const double w = desc_.width - 1.0, h = desc_.height - 1.0;
    Eigen::Vector2d low, high;
    std::array<Eigen::Vector2d, 2> middle;
    for (int view = 0; view < 2; ++view) {
        low.setConstant(std::numeric_limits<double>::max());
        high = -low;
        for_each_pixel(desc_.width, desc_.height, [&](const Eigen::Vector2d& pixel) {
            Eigen::Vector2d direction;
            if (!lens_[view].unproject(pixel, direction)) return;
            const Eigen::Vector3d turned = rotation_[view] * direction.homogeneous();
            if (turned.z() <= 0)
                fail(DEFREC_ERROR_UNSUPPORTED, "the cameras look in too different directions");
            low = low.cwiseMin(turned.hnormalized());
            high = high.cwiseMax(turned.hnormalized());
        });
        middle[view] = (low + high) / 2;
    }
    const Eigen::Vector2d both = middle[0] / 2 + middle[1] / 2;
    camera_ = {f,
               f,
               w / 2 - f * both.x(),
               h / 2 - f * both.y(),
               Eigen::Map<const Eigen::Vector3d>(desc_.translation).norm(),
               0};
    // The disparity of the place that both views have in the middle of their raw images, px. The
    // middle of the bounds lies beside it where the views are turned.
    std::array<double, 2> axis{};
    for (int view = 0; view < 2; ++view) {
        Eigen::Vector2d direction;
        if (!lens_[view].unproject({w / 2, h / 2}, direction)) return;
        const Eigen::Vector3d turned = rotation_[view] * direction.homogeneous();
        axis[static_cast<size_t>(view)] = turned.x() / turned.z();
    }
    const double at_middle = f * (axis[0] - axis[1]);
    if (at_middle <= decisions::Convergence::kShared * desc_.width) return;
    camera_.cx = w / 2 - f * middle[0].x();
    // A depth of dz is a disparity of about (dz / field) (baseline / distance) width.
    const double behind =
        std::max(decisions::Convergence::kBehind, decisions::Convergence::kRelief * at_middle / f);
    camera_.disparity_offset_px = std::floor(at_middle - behind * desc_.width);
}

std::vector<int32_t> Rig::shifted_right_map(const ViewShift& shift) const {
    std::vector<int32_t> map(2 * size_t{desc_.width} * desc_.height);
    fill_map(1, shift, map.data());
    return map;
}

void Rig::fill_map(int view, const ViewShift& shift, int32_t* map) const {
    const size_t width = desc_.width, height = desc_.height;
    const Eigen::Vector2d centre((width - 1.0) / 2, (height - 1.0) / 2);
    Eigen::Matrix2d turn;
    turn << 1 + shift.ratio, -shift.roll, shift.roll, 1 + shift.ratio;
    const Eigen::Vector2d offset(0, shift.offset_px);
    const double max_x = (width - 1.0) * kMapOne, max_y = (height - 1.0) * kMapOne;
    services_->parallel_for(height, [&](size_t row) noexcept {
        int32_t* out = map + 2 * width * row;
        for (size_t column = 0; column < width; ++column, out += 2) {
            out[0] = out[1] = std::numeric_limits<int32_t>::min();
            const Eigen::Vector2d from =
                turned(view, {double(column), double(row)}, shift.vergence) - centre;
            Eigen::Vector2d raw = turn * from + offset + centre;
            if (!identity_ && !to_raw(view, Eigen::Vector2d(raw), raw)) continue;
            const double x = std::floor(raw.x() * kMapOne + 0.5),
                         y = std::floor(raw.y() * kMapOne + 0.5);
            if (!(x >= 0 && x <= max_x && y >= 0 && y <= max_y)) continue;
            out[0] = static_cast<int32_t>(x);
            out[1] = static_cast<int32_t>(y);
        }
    });
}

// A rectified pixel's place in a view that is turned about its vertical axis, rad.
Eigen::Vector2d Rig::turned(int view, const Eigen::Vector2d& rectified, double angle) const {
    if (angle == 0) return rectified;
    const double x = (rectified.x() - principal_x(view)) / camera_.fx,
                 y = (rectified.y() - camera_.cy) / camera_.fy,
                 z = std::cos(angle) - std::sin(angle) * x;
    return {principal_x(view) + camera_.fx * (std::cos(angle) * x + std::sin(angle)) / z,
            camera_.cy + camera_.fy * y / z};
}

bool Rig::to_raw(int view, const Eigen::Vector2d& rectified, Eigen::Vector2d& raw) const {
    const Eigen::Vector3d ray((rectified.x() - principal_x(view)) / camera_.fx,
                              (rectified.y() - camera_.cy) / camera_.fy, 1);
    const Eigen::Vector3d turned = rotation_[view].transpose() * ray;
    return turned.z() > 0 && lens_[view].project(turned.hnormalized(), raw);
}

bool Rig::to_rectified(int view, const Eigen::Vector2d& raw, Eigen::Vector2d& rectified) const {
    Eigen::Vector2d direction;
    if (!lens_[view].unproject(raw, direction)) return false;
    const Eigen::Vector3d turned = rotation_[view] * direction.homogeneous();
    rectified = {camera_.fx * turned.x() / turned.z() + principal_x(view),
                 camera_.fy * turned.y() / turned.z() + camera_.cy};
    return turned.z() > 0;
}

template <class Convert>
void Rig::convert_pixels(const double* in, size_t count, double* out, Convert convert) const {
    for (size_t i = 0; i < count; ++i) {
        const Eigen::Vector2d from(in[2 * i], in[2 * i + 1]);
        Eigen::Vector2d to;
        if (identity_) {
            to = from;
        } else if (!from.allFinite() || !convert(from, to) || !to.allFinite()) {
            to.setConstant(std::numeric_limits<double>::quiet_NaN());
        }
        out[2 * i] = to.x();
        out[2 * i + 1] = to.y();
    }
}

std::optional<Eigen::Vector2d> Rig::pixel_of(int view, const float place[3],
                                             bool is_rectified) const {
    const double z = place[2], x = place[0] - (view == 1 ? camera_.baseline_mm : 0);
    if (!(z > 0)) return std::nullopt;
    const double u = std::round(camera_.fx * x / z + principal_x(view)),
                 v = std::round(camera_.fy * place[1] / z + camera_.cy);
    if (!(u >= 0 && v >= 0 && u < width() && v < height())) return std::nullopt;
    if (is_rectified || map(view) == nullptr) return Eigen::Vector2d(u, v);
    constexpr double kMapUnit = 128;  // per px
    const int32_t* raw =
        map(view) + 2 * (static_cast<size_t>(v) * width() + static_cast<size_t>(u));
    if (raw[0] == INT32_MIN) return std::nullopt;
    return Eigen::Vector2d(raw[0] / kMapUnit, raw[1] / kMapUnit);
}

void Rig::rectify_pixels(int view, const double* raw_uv, size_t count, double* rectified_uv) const {
    convert_pixels(raw_uv, count, rectified_uv,
                   [&](const auto& from, auto& to) { return to_rectified(view, from, to); });
}

void Rig::distort_pixels(int view, const double* rectified_uv, size_t count, double* raw_uv) const {
    convert_pixels(rectified_uv, count, raw_uv,
                   [&](const auto& from, auto& to) { return to_raw(view, from, to); });
}

defrec_rig_info Rig::info() const {
    defrec_rig_info info{};
    info.struct_size = sizeof info;
    info.identity = identity_;
    info.width = desc_.width;
    info.height = desc_.height;
    info.camera = camera_;
    Eigen::Map<RowMajor>(info.rotation) = rotation_[0];
    return info;
}

}  // namespace defrec
