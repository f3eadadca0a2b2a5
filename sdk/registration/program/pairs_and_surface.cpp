// See pairs_and_surface.hpp.
#include "sdk/registration/program/pairs_and_surface.hpp"

#include <Eigen/Core>
#include <cmath>
#include <numbers>

#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

}  // namespace

std::string held_by_pairs(const Registered& by_surface, const PairsFile& pairs,
                          const Registered& by_pairs) {
    const Eigen::Map<const Matrix6> twist(by_pairs.info.covariance);
    const Eigen::Vector3d middle =
        Eigen::Map<const Eigen::Matrix3Xd>(pairs.seen_xyz.data(), 3,
                                           static_cast<Eigen::Index>(pairs.ids.size()))
            .rowwise()
            .mean();
    Eigen::Matrix<double, 3, 6> shift;  // of the middle, by a twist
    shift << 0, middle.z(), -middle.y(), 1, 0, 0, -middle.z(), 0, middle.x(), 0, 1, 0, middle.y(),
        -middle.x(), 0, 0, 0, 1;
    std::string text;
    for (std::size_t i = 0; i < by_surface.info.free_motion_count; ++i) {
        auto motion = initialised<defrec_free_motion>();
        require(defrec_registration_get_free_motion(by_surface.handle.get(), i, &motion),
                ExitCode::kInternal, "reading the result");
        const Eigen::Map<const Eigen::Vector3d> axis(motion.axis);
        text += i > 0 ? ", " : "";
        if (motion.kind == DEFREC_FREE_TURN) {
            const double turn = std::sqrt(axis.dot(twist.topLeftCorner<3, 3>() * axis));
            text += format_fixed(turn * 180 / std::numbers::pi, 2) + " degrees";
        } else {
            const double along = (shift.transpose() * axis).dot(twist * shift.transpose() * axis);
            text += format_fixed(std::sqrt(along), 2) + " mm";
        }
    }
    return text;
}

}  // namespace defrec::cli
