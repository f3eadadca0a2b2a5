// How the command line names a camera.
#pragma once

#include <optional>
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

// A source, or a sentence about one, as it is shown and written: without users and passwords, those
// of addresses ("rtsp://***@HOST/left") and the passwords that a pipeline's elements are given.
std::string shown_source(const std::string& source);

// A source that was shown, without the mark of what is hidden in its address, if it has one.
std::optional<std::string> without_hidden_user(const std::string& shown);

}  // namespace defrec::cli
