// The folder that `defrec record` writes: its names, and how it is opened.
#pragma once

#include <filesystem>

#include "sdk/input/frame_source.hpp"

namespace defrec::cli {

inline constexpr char kRecordingFile[] = "recording.json";
inline constexpr char kTimesFile[] = "times.csv";
inline constexpr char kLeftFolder[] = "left";
inline constexpr char kRightFolder[] = "right";
// Matroska: what a killed run leaves can be read, which MP4 without its end cannot.
inline constexpr char kLeftVideo[] = "left.mkv";
inline constexpr char kRightVideo[] = "right.mkv";
inline constexpr char kVideoFormat[] = "h264";  // of recording.json

// Sets what names the images or videos, their times and their rate. Throws CliError(kInput) where
// the folder holds no recording that was finished, or not the times of all of its images.
void open_recorded_folder(const std::filesystem::path& folder, SourceOptions& source);

}  // namespace defrec::cli
