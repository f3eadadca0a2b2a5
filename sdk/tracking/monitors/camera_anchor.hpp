// Where a fixed frame, of a navigation system, lay in the camera when the template was captured.
#pragma once
#include <Eigen/Geometry>
#include <optional>

namespace defrec {

class CameraAnchor {
  public:
    // For another template.
    void reset() { at_rest_.reset(); }
    // The motion, rectified camera from template frame, of what stands still in the fixed frame;
    // none where nobody tells the camera's pose. pose: fixed frame from rectified camera, of this
    // frame. rigid_motion: of the surface in it, 3x4 row-major; the first frame with both is the
    // anchor.
    std::optional<Eigen::Isometry3d> add_frame(const std::optional<Eigen::Isometry3d>& pose,
                                               const double* rigid_motion) {
        if (!pose) return std::nullopt;
        if (!at_rest_) {
            Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
            motion.matrix().topRows<3>() =
                Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(rigid_motion);
            at_rest_ = *pose * motion;
        }
        return pose->inverse() * *at_rest_;
    }

  private:
    std::optional<Eigen::Isometry3d> at_rest_;
};

}  // namespace defrec
