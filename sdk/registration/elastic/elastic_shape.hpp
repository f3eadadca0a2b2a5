// A model's shape after an elastic fit, and what is not known of it.
#pragma once
#include <Eigen/Core>
#include <memory>
#include <vector>

#include "sdk/registration/elastic/force_modes.hpp"
#include "sdk/registration/registration.hpp"

namespace defrec {

class ElasticShape : public ModelShape {
  public:
    struct Parts {
        std::shared_ptr<const ForceModes> modes;
        Eigen::VectorXd coefficients;
        // (6 + modes)^2: twist about the origin of the frame that is seen, then coefficients.
        Eigen::MatrixXd covariance;
        // Places of the model at rest whose displacement was seen.
        std::vector<Eigen::Vector3f> seen;
        double rms_strain;
    };
    explicit ElasticShape(Parts parts);

    PlacedPoint placed(const Pose& pose, const Eigen::Vector3d& place) const override;

  private:
    // How far what was seen lies, mm.
    double distance_seen(const Eigen::Vector3d& place) const;

    Parts parts_;
    Eigen::MatrixXd root_;  // root root^T is the covariance
};

}  // namespace defrec
