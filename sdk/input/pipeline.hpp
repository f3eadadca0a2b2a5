// One or two cameras as a GStreamer pipeline.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sdk/input/frame_pairs.hpp"

namespace defrec::cli {

class Pipeline {
  public:
    struct Image {
        CameraImage image;
        double fps;  // 0: the camera does not say
    };
    // Called by the pipeline's threads, with the number of the camera.
    using Receiver = std::function<void(std::size_t camera, Image image)>;

    // Starts. Times are those of one clock for all pipelines of this computer, ms. Throws
    // CliError(kInput).
    Pipeline(const std::vector<std::string>& cameras, Receiver receiver);
    // No call of the receiver is left when it returns.
    ~Pipeline();
    Pipeline(const Pipeline&) = delete;
    Pipeline& operator=(const Pipeline&) = delete;

    // What stopped a camera, in the words of GStreamer; empty while all goes well.
    std::string take_error();
    // A camera has delivered its last image.
    bool has_ended() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace defrec::cli
