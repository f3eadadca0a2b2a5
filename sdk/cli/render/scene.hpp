// The reference scenes: what moves and when. docs/reference_sequences.md says why.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "sdk/cli/render/instrument.hpp"
#include "sdk/cli/render/picture.hpp"
#include "sdk/cli/render/render_command.hpp"
#include "sdk/cli/render/rig.hpp"
#include "sdk/cli/render/surface.hpp"
#include "sdk/cli/render/tissue.hpp"

namespace defrec::cli {

/// x_camera = rotation * (x_scene - centre), for the left view.
struct CameraPose {
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
};

/// All that differs from frame to frame.
struct FrameState {
    double time = 0;  ///< frames
    Motion motion;
    CameraPose camera;
    std::vector<Instrument> instruments;  ///< scene's frame
    Smoke smoke;
    Outside outside = Outside::none;
    bool repeats_previous = false;  ///< a dropped frame: picture and truth of the frame before
};

struct Scene {
    SceneInfo info;
    StereoRig rig;
    TissueLook look;
    std::uint64_t seed = 0;  ///< of this scene's organ: each scene has another
    Surface surface;
    float exposure = 1;
    std::function<FrameState(int frame)> at;  ///< frame 0..frames-1, in any order
};

/// Throws RenderUsageError for an unknown scene or parameter and for a value out of range. frames
/// and settings as RenderOptions has them; events such as cuts fall at fixed shares of the
/// sequence, motion has its own pace.
Scene make_scene(const std::string& name, int width, int height, int frames, std::uint64_t seed,
                 const std::vector<SceneSetting>& settings);

}  // namespace defrec::cli
