// How the command line names a camera.
#include "sdk/input/camera_name.hpp"

#include <filesystem>
#include <string_view>

namespace defrec::cli {

CameraName parse_camera(const std::string& source) {
    constexpr std::string_view kPipelinePrefix = "gst:";
    if (source.starts_with(kPipelinePrefix))
        return {CameraName::Kind::kPipeline, source.substr(kPipelinePrefix.size())};
    if (source.starts_with("rtsp") && source.find("://") != std::string::npos)
        return {CameraName::Kind::kRtsp, source};
    std::error_code error;
    if (std::filesystem::is_character_file(source, error))
        return {CameraName::Kind::kDevice, source};
    return {};
}

}  // namespace defrec::cli
