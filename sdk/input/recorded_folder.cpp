// See recorded_folder.hpp.
#include "sdk/input/recorded_folder.hpp"

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "sdk/input/frame_times.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr std::size_t kMaxBytes = 1'000'000;
constexpr double kHighestRate = 10000;

}  // namespace

void open_recorded_folder(const std::filesystem::path& folder, SourceOptions& source) {
    const auto fail = [&](const std::string& fault) {
        throw CliError(ExitCode::kInput, folder.string() + ": " + fault);
    };
    std::error_code error;
    if (!std::filesystem::exists(folder / kRecordingFile, error))
        fail(
            "there is no recording.json: no recording of `defrec record`, or one that was not "
            "finished, whose images and times are given by --left, --right and --times.");
    const auto json = nlohmann::json::parse(
        read_file(folder / kRecordingFile, kMaxBytes, ExitCode::kInput), nullptr, false);
    if (!json.is_object() || !json.contains("frames") || !json["frames"].is_number_unsigned() ||
        !json.contains("fps") || !json["fps"].is_number())
        fail("recording.json is not as `defrec record` writes it.");
    const double fps = json["fps"].get<double>();
    if (!(fps > 0 && fps <= kHighestRate)) fail("recording.json has no rate of images.");
    source.recording = folder / kRecordingFile;
    const bool is_video = json.contains("format") && json["format"] == kVideoFormat;
    source.left = folder / (is_video ? kLeftVideo : kLeftFolder);
    source.right = folder / (is_video ? kRightVideo : kRightFolder);
    source.times = folder / kTimesFile;
    source.fps = fps;
    source.times_ms = read_frame_times(source.times);
    const auto frames = json["frames"].get<std::uint64_t>();
    if (source.times_ms.size() != frames)
        fail("recording.json says " + std::to_string(frames) + " frames, but times.csv has " +
             std::to_string(source.times_ms.size()) + ".");
}

}  // namespace defrec::cli
