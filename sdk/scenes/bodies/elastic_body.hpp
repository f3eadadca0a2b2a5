// An elastic body under the surface of a scene: how a load displaces its material, and the rigid
// motion that the whole body has besides.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <memory>

namespace defrec::cli {

/// mm beneath the surface at rest, along z of the scene: the layers of material that a body gives
/// the displacement of. The first is the surface.
inline constexpr std::array<double, 7> kBodyDepths{0, 2, 5, 10, 20, 30, 40};

/// What acts on a body in one frame. A body uses the members that its kind of load has.
struct BodyLoad {
    Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< material coordinates
    double press = 0;  ///< mm away from the camera, of the surface at the centre; negative: a pull
    Eigen::Vector2d drag = Eigen::Vector2d::Zero();  ///< mm along the surface, at the centre
    double share = 0;  ///< 0..1 of the largest load that a body of recorded loads has
};

class ElasticBody {
  public:
    virtual ~ElasticBody() = default;
    /// mm, scene's axes; of the material (s, t) in a layer of kBodyDepths.
    virtual Eigen::Vector3d displacement(const BodyLoad& load, double s, double t,
                                         std::size_t layer) const = 0;
};

/// The motion of a body in one frame: first the elastic displacement, then the rigid motion.
struct BodyMotion {
    std::shared_ptr<const ElasticBody> elastic;  ///< null: rigid alone
    BodyLoad load;
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< mm, scene's frame

    Eigen::Vector3d moved(const Eigen::Vector3d& rest, double s, double t,
                          std::size_t layer) const {
        const Eigen::Vector3d deformed =
            elastic ? Eigen::Vector3d(rest + elastic->displacement(load, s, t, layer)) : rest;
        return rotation * deformed + translation;
    }
};

}  // namespace defrec::cli
