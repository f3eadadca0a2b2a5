// The reference scenes: what moves and when. docs/program/reference_sequences.md says why.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sdk/scenes/bodies/solid.hpp"
#include "sdk/scenes/instrument.hpp"
#include "sdk/scenes/picture.hpp"
#include "sdk/scenes/rig.hpp"
#include "sdk/scenes/scene_list.hpp"
#include "sdk/scenes/sheet.hpp"
#include "sdk/scenes/surface.hpp"
#include "sdk/scenes/tissue.hpp"

namespace defrec::cli {

/// x_camera = rotation * (x_scene - centre), for the left view.
struct CameraPose {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
};

/// How the right view differs from what calibration.yaml and the left view's clock say.
struct RightView {
    double lag = 0;          ///< frames by which it is late; negative: early
    double offset = 0;       ///< px by which all is lower in its image
    double roll = 0;         ///< rad about its axis: lowers what is right of the middle
    double vergence = 0;     ///< rad about its vertical axis: moves its image to the right
    double focal_ratio = 1;  ///< true over calibrated focal length
    float exposure = 0.93f;  ///< of the green channel; 1: as the left view's
    float gamma = 1;         ///< as Sensor has it

    bool misaligned() const {
        return offset != 0 || roll != 0 || vergence != 0 || focal_ratio != 1;
    }
};

/// All that differs from frame to frame.
struct FrameState {
    double time = 0;  ///< frames
    Motion motion;
    std::vector<MeshFormula> sheets;  ///< of each of Scene::sheets
    CameraPose camera;
    std::vector<Instrument> instruments;  ///< scene's frame
    std::optional<Blood> blood;
    Sheen sheen;         ///< lamps in the left view's frame
    float exposure = 1;  ///< share of the scene's: the camera's own control
    Smoke smoke;
    Focus focus;
    double shutter = 0;  ///< frames that the exposure lasts; `time` is its middle
    RightView right;
    Outside outside = Outside::none;
    bool repeats_previous = false;  ///< a dropped frame: picture and truth of the frame before
};

/// What the video lost before it was decoded into the files.
struct Compression {
    int jpeg_quality = 0;      ///< 1..100 of each image; 0: not compressed
    double h264_contrast = 0;  ///< of the video of each view, after JPEG; 0: no video
};

/// Material coordinates, mm.
struct BodyParts {
    Box whole;  ///< of a layer without sides: a part of it
    Box held;   ///< what moves rigidly lies inside
    std::optional<Ball> inclusion{};
};

/// The elastic body that a scene's tissue is.
struct Body {
    std::shared_ptr<const ElasticBody> elastic;  ///< null: it only moves rigidly
    std::size_t layers = kBodyDepths.size();     ///< of kBodyDepths that lie inside
    std::optional<BodyParts> parts;              ///< where it is bounded
};

struct Scene {
    SceneInfo info;
    StereoRig rig;
    TissueLook look;
    std::uint64_t seed = 0;  ///< of this scene's organ: each scene has another
    Surface surface;
    float exposure = 1;
    bool has_coaxial_light = false;             ///< through the objective between the views
    float noise = 1;                            ///< of the sensor, as Sensor has it
    Compression compression{};                  ///< of the files; a Film's pictures have none of it
    std::optional<TissueLook> floor{};          ///< of the cut, in a scene with one
    std::vector<Texture> textures{};            ///< of the sheets
    std::vector<Sheet> sheets{};                ///< replace the surface, in a scene with some
    std::optional<Body> body;                   ///< in a scene with targets beneath the surface
    std::function<FrameState(double time)> at;  ///< frames, whole or not, in any order
};

/// Throws RenderUsageError for an unknown scene or parameter and for a value out of range. frames
/// and settings as RenderOptions has them; events such as cuts fall at fixed shares of the
/// sequence, motion has its own pace.
Scene make_scene(const std::string& name, int width, int height, int frames, std::uint64_t seed,
                 const std::vector<SceneSetting>& settings);

}  // namespace defrec::cli
