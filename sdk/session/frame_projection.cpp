// From the rectified camera's millimetres to pixels of the left image as given.
#include "sdk/session/frame_projection.hpp"

#include <cmath>
#include <limits>

#include "sdk/session/decisions.hpp"

namespace defrec::cli {
namespace {

// Pinhole projection u = fx x / z + cx; NaN where it is not defined.
template <typename T>
void pinhole(const defrec_camera& camera, const T* xyz, double* uv) {
    const double x = xyz[0], y = xyz[1], z = xyz[2];
    const bool is_defined = std::isfinite(x) && std::isfinite(y) && std::isfinite(z) &&
                            z > decisions::FollowedPoints::kNearest;
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    uv[0] = is_defined ? camera.fx * x / z + camera.cx : kNaN;
    uv[1] = is_defined ? camera.fy * y / z + camera.cy : kNaN;
}

}  // namespace

RawProjection::RawProjection(const Rig& rig) : rig_(rig), camera_(rig_info(rig).camera) {}

void RawProjection::distort(double* uv, std::size_t count) const {
    require(defrec_rig_distort_pixels(rig_.get(), uv, count, uv), ExitCode::kInternal,
            "mapping pixels");
}

void RawProjection::project(const double* xyz, std::size_t count, double* uv) {
    project_rectified(xyz, count, uv);
    distort(uv, count);
}

void RawProjection::project_rectified(const double* xyz, std::size_t count, double* uv) const {
    for (std::size_t i = 0; i < count; ++i) pinhole(camera_, xyz + 3 * i, uv + 2 * i);
}

void RawProjection::project(const float* xyz, std::size_t count, float* uv) {
    scratch_.resize(2 * count);
    for (std::size_t i = 0; i < count; ++i) pinhole(camera_, xyz + 3 * i, scratch_.data() + 2 * i);
    distort(scratch_.data(), count);
    for (std::size_t i = 0; i < 2 * count; ++i) uv[i] = static_cast<float>(scratch_[i]);
}

}  // namespace defrec::cli
