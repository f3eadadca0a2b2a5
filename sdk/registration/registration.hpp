// Registration of a preoperative model: the motion from its frame to the frame that a camera sees
// (the template frame), rigid or with a deformation, how exactly it is known, and whether it may be
// used.
#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sdk/registration/pose.hpp"
#include "sdk/registration/uncertainty.hpp"

namespace defrec {

enum class RegistrationVerdict {
    kRegistered,
    kAmbiguous,     // another pose fits as well
    kUndetermined,  // the data leave a motion open
    kFailed         // no pose fits
};

struct RegistrationResiduals {
    double rms_mm = 0;        // of the inliers
    double robust_mm = 0;     // robust standard deviation of all
    double error_ratio = 0;   // that of the residuals in units of their expected errors
    double inlier_share = 0;  // of the data that were compared
    double correlated = 1;    // so many neighbours have one error
    uint64_t used = 0;        // data that were compared
};

// Another pose that was found.
struct RegistrationAlternative {
    Pose pose;
    double distance_mm = 0;  // root mean square by which it moves the data against the result
    double rms_mm = 0;
    double inlier_share = 0;
};

// A place of the model in the frame that is seen, mm, and the covariance of its error, mm^2.
struct PlacedPoint {
    Eigen::Vector3d place;
    Eigen::Matrix3d covariance;
};

// The shape that a model has where it lies.
class ModelShape {
  public:
    virtual ~ModelShape() = default;
    // place: of the model at rest, finite; pose: the registration's. Any thread.
    virtual PlacedPoint placed(const Pose& pose, const Eigen::Vector3d& place) const = 0;
};

enum class DeformationVerdict { kNotAsked, kApplied, kRefused };

struct ModelDeformation {
    DeformationVerdict verdict = DeformationVerdict::kNotAsked;
    std::string reason;                            // one sentence
    std::shared_ptr<const ModelShape> shape;       // null: the model is as it was
    double rms_mm = 0, max_mm = 0;                 // displacements of the model's vertices
    double largest_strain = 0;                     // share, along any direction
    double rigid_rms_mm = 0, rigid_robust_mm = 0;  // the residuals before it
};

struct Registration {
    RegistrationVerdict verdict = RegistrationVerdict::kFailed;
    std::string reason;  // one sentence
    Pose pose;           // from the model's frame to the one that is seen: of all motion the rigid
                         // part
    // Covariance of the twist about the frame's origin that the true pose has after `pose`, see
    // place_shift: turn in rad about x, y, z, then shift in mm.
    TwistMatrix covariance = TwistMatrix::Zero();
    // The part of it that a shift of all that was seen has, mm^2, which residuals do not show.
    Eigen::Matrix3d seen_shift = Eigen::Matrix3d::Zero();
    std::vector<FreeMotion> free;
    RegistrationResiduals residuals;
    std::vector<RegistrationAlternative> alternatives;  // those that fit nearly as well first
    // For each point that was given: mm, along the model's outside normal; of a pair its length.
    // NaN where it was not compared.
    std::vector<float> residual_mm;
    std::vector<uint8_t> is_inlier;
    ModelDeformation deformation;

    void add_seen_shift(const Eigen::Matrix3d& shift_covariance) {
        seen_shift += shift_covariance;
        covariance.bottomRightCorner<3, 3>() += shift_covariance;
    }
    PlacedPoint placed(const Eigen::Vector3d& model_place) const {
        if (deformation.shape) {
            PlacedPoint point = deformation.shape->placed(pose, model_place);
            point.covariance += seen_shift;
            return point;
        }
        const Eigen::Vector3d place = pose * model_place;
        return {place, target_covariance(covariance, place)};
    }
};

const char* name_of(RegistrationVerdict verdict);

}  // namespace defrec
