// See run_hand_eye.hpp.
#include "sdk/hand_eye/program/run_hand_eye.hpp"

#include <nlohmann/json.hpp>
#include <numbers>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/base/util/error.hpp"
#include "sdk/hand_eye/hand_eye.hpp"
#include "sdk/hand_eye/program/hand_eye_json.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/output_folder.hpp"
#include "sdk/io/terminal.hpp"

namespace defrec::cli {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

HandEyeOptions options_of(const HandEyeCommand& command) {
    const bool has_camera = command.camera_error_mm && command.camera_error_degrees,
               has_tracker = command.tracker_error_mm && command.tracker_error_degrees,
               has_any = command.camera_error_mm || command.camera_error_degrees ||
                         command.tracker_error_mm || command.tracker_error_degrees;
    if (has_any && !(has_camera && has_tracker))
        throw CliError(ExitCode::kUsage,
                       "errors are stated of both files, in mm and in degrees, or of none: give "
                       "--camera-error, --camera-error-deg, --tracker-error and "
                       "--tracker-error-deg.");
    if (command.is_paired && (command.offset_s || command.max_offset_s))
        throw CliError(ExitCode::kUsage,
                       "poses in pairs have no offset in time; give either --pairs, or --offset or "
                       "--max-offset.");
    HandEyeOptions options;
    if (has_any)
        options.noise = {*command.camera_error_mm, *command.camera_error_degrees * kDegree,
                         *command.tracker_error_mm, *command.tracker_error_degrees * kDegree};
    options.is_paired = command.is_paired;
    options.offset_s = command.offset_s;
    if (command.max_offset_s) options.max_offset_s = *command.max_offset_s;
    if (command.max_residual_mm) options.max_residual_mm = *command.max_residual_mm;
    if (command.max_residual_degrees)
        options.max_residual_rad = *command.max_residual_degrees * kDegree;
    if (command.max_error_mm) options.max_error_mm = *command.max_error_mm;
    return options;
}

// The poses, the right way round, and a note on what they were taken for.
std::vector<TimedPose> load(const std::string& path, std::optional<PoseUnit> unit, bool is_inverted,
                            bool is_ordered, std::vector<std::string>& notes) {
    PoseFile file = read_timed_poses(path, unit, is_ordered);
    if (is_inverted)
        for (TimedPose& pose : file.poses) pose.pose = pose.pose.inverse();
    if (!unit)
        notes.push_back(path + ": " +
                        (file.is_tum ? "a TUM trajectory; lengths were taken to be in "
                                     : "lengths were taken to be in ") +
                        name_of(file.unit) + ".");
    return std::move(file.poses);
}

}  // namespace

int run_hand_eye(const HandEyeCommand& command) {
    const HandEyeOptions options = options_of(command);
    for (const std::string& input : {command.camera_poses, command.tracker_poses})
        if (!command.out.empty()) keep_input(input, {command.out});
    std::vector<std::string> notes;
    const bool is_ordered = !command.is_paired;
    const std::vector<TimedPose> camera = load(command.camera_poses, command.camera_unit,
                                               command.is_camera_inverted, is_ordered, notes),
                                 tracker = load(command.tracker_poses, command.tracker_unit,
                                                command.is_tracker_inverted, is_ordered, notes);
    HandEyeCalibration calibration;
    try {
        calibration = calibrate_hand_eye(camera, tracker, options);
    } catch (const Error& error) {
        throw CliError(ExitCode::kInput, std::string(error.what()) + ".");
    }
    calibration.notes.insert(calibration.notes.begin(), notes.begin(), notes.end());
    const std::string json = json_text(hand_eye_json(calibration), 2) + "\n";
    if (!command.out.empty()) write_atomically(command.out, json);
    if (!command.quiet) print(command.json ? json : hand_eye_text(calibration));
    return static_cast<int>(calibration.verdict == HandEyeVerdict::kSolved ? ExitCode::kOk
                                                                           : ExitCode::kFound);
}

}  // namespace defrec::cli
