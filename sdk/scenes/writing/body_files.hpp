// The files of a scene with an elastic body: targets, their truth, the body's parts as meshes and
// the motion of what is held.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/scenes/film.hpp"

namespace defrec::cli {

class BodyFiles {
  public:
    /// rectification: from the left camera as given to the rectified one. Writes nothing yet.
    BodyFiles(const std::filesystem::path& folder, const Film& film,
              const Eigen::Matrix3d& rectification);

    /// After each of the film's frames, from 0 on.
    void write(int frame);
    /// Gives the files that last all the sequence their names.
    void commit();

    /// All that may be there.
    static std::vector<std::string> names();

  private:
    std::string row_of(std::size_t target) const;
    Eigen::Isometry3d body_pose() const;
    void write_first() const;

    const std::filesystem::path folder_;
    const Film& film_;
    const Eigen::Matrix3d rectification_;
    Eigen::Isometry3d first_pose_ = Eigen::Isometry3d::Identity();
    AtomicFile deep_truth_;
    std::optional<AtomicFile> held_motion_;
};

}  // namespace defrec::cli
