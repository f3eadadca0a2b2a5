// What the list of scenes has of each.
#pragma once

#include <vector>

#include "sdk/scenes/scene_setting.hpp"

namespace defrec::cli {

/// The look of tissue in scenes that ask for nothing special.
inline constexpr TissueLook kOrgan{.mottling = 0.75f, .vessels = 0.9f, .spots = 0.7f};

struct Entry {
    SceneInfo info;
    TissueLook look;
    double relief;
    float exposure;
    FrameState (*at)(const Setting&, double);
    void (*adapt)(const SceneParameters&, Scene&) = nullptr;  ///< of what lasts all the sequence
    double curvature = 0;                                     ///< as Surface has it
    Body (*body)(const SceneParameters&) = nullptr;           ///< of a scene with an elastic body
    double bend = 1;                                          ///< as Surface has it
    StereoRig (*rig)(const SceneParameters&, int width, int height) = nullptr;  ///< of its own
};

}  // namespace defrec::cli
