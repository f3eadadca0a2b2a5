// How the command line names a camera.
#pragma once

#include <string>

namespace defrec::cli {

struct CameraName {
    enum class Kind { kNone, kRtsp, kDevice, kPipeline };
    Kind kind = Kind::kNone;
    std::string address;  // or the pipeline, without "gst:"
};

// "rtsp://...", a device such as /dev/video0, or "gst:" and a GStreamer pipeline; kNone for all
// else.
CameraName parse_camera(const std::string& source);

}  // namespace defrec::cli
