// Images of one or two cameras as they come, the newest first: what was not taken in time is
// dropped, and a camera that stops is started again.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sdk/input/camera_counts.hpp"
#include "sdk/input/frame_pairs.hpp"

namespace defrec::cli {

struct CameraOptions {
    // By the names of camera_name.hpp: two, or one whose images carry both views.
    std::vector<std::string> cameras;
    double fps = 0;                 // where a camera does not say
    double reconnect_seconds = 60;  // for which a camera that stopped is looked for
};

// One thread at a time.
class CameraSource {
  public:
    // Throws CliError(kInput) when a camera cannot be opened.
    explicit CameraSource(const CameraOptions& options);
    ~CameraSource();
    CameraSource(const CameraSource&) = delete;
    CameraSource& operator=(const CameraSource&) = delete;

    // Waits for images newer than those before; of one camera, right is left empty. Throws
    // CliError(kInput) when no first image comes within 10 s. False at the end of a pipeline, when
    // the user wants to end, and when a camera does not come back; fault() then says why.
    bool read(CameraPair& pair);
    const std::string& fault() const;
    // Images per second as the left camera says; 0 when it does not.
    double fps() const;
    CameraCounts counts() const;
    // Is told in words that a camera stopped, and that it is back.
    void set_notice_handler(std::function<void(const std::string&)> handler);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace defrec::cli
