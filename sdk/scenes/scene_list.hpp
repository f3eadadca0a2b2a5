// The scenes that there are, and what may be set in them.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

namespace defrec::cli {

/// The request cannot be carried out as written (unknown scene or parameter, bad size): exit code
/// 2, what() for the user.
class RenderUsageError : public std::invalid_argument {
  public:
    using std::invalid_argument::invalid_argument;
};

/// A number of a scene that the user may set; every other number of a scene is fixed.
struct SceneParameter {
    std::string name;
    double initial = 0, lowest = 0, highest = 0;  ///< the range is inclusive
    std::string unit;                             ///< empty: a pure number
    std::string summary;                          ///< one line
};

struct SceneSetting {
    std::string parameter;
    double value = 0;
};

struct SceneInfo {
    std::string name;
    std::string summary;  ///< one line
    bool rectified =
        true;  ///< false: raw images with lens distortion from two cameras that are not parallel
    int default_frames = 60;
    std::vector<SceneParameter> parameters{};  ///< may be empty
};

/// Every scene that can be rendered, in the order in which they are listed.
std::vector<SceneInfo> list_scenes();

}  // namespace defrec::cli
