// How the command line names a camera.
#include "sdk/input/camera_name.hpp"

#include <filesystem>
#include <string_view>

namespace defrec::cli {
namespace {

constexpr std::string_view kAfterScheme = "://";
constexpr std::string_view kHidden = "***";  // stands for what is hidden

void hide_users(std::string& text) {
    constexpr auto kNone = std::string::npos;
    for (std::size_t at = text.find(kAfterScheme); at != kNone; at = text.find(kAfterScheme, at)) {
        at += kAfterScheme.size();
        const std::size_t end = text.find_first_of("/?# \t\"'", at);
        const std::size_t user = std::string_view(text).substr(at, end - at).rfind('@');
        if (user != kNone) text.replace(at, user, kHidden);
    }
}

// "user-pw=secret", as rtspsrc has it.
void hide_passwords(std::string& text) {
    constexpr std::string_view kProperty = "user-pw";
    constexpr auto kNone = std::string::npos;
    for (std::size_t at = text.find(kProperty); at != kNone; at = text.find(kProperty, at)) {
        at = text.find_first_not_of(' ', at + kProperty.size());
        if (at == kNone) return;
        if (text[at] != '=') continue;
        at = text.find_first_not_of(' ', at + 1);
        if (at == kNone) return;
        const bool is_quoted = text[at] == '"' || text[at] == '\'';
        const std::size_t end =
            is_quoted ? text.find(text[at], at + 1) : text.find_first_of(" \t", at);
        at += is_quoted ? 1 : 0;
        text.replace(at, end == kNone ? end : end - at, kHidden);
    }
}

}  // namespace

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

std::string shown_source(const std::string& source) {
    std::string shown = source;
    hide_users(shown);
    hide_passwords(shown);
    return shown;
}

std::optional<std::string> without_hidden_user(const std::string& shown) {
    const std::string mark = std::string(kAfterScheme).append(kHidden).append("@");
    const std::size_t at = shown.find(mark);
    if (at == std::string::npos) return std::nullopt;
    return std::string(shown).erase(at + kAfterScheme.size(), mark.size() - kAfterScheme.size());
}

}  // namespace defrec::cli
