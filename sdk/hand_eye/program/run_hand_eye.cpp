// See run_hand_eye.hpp.
#include "sdk/hand_eye/program/run_hand_eye.hpp"

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string_view>
#include <utility>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/hand_eye/program/hand_eye_json.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/output_folder.hpp"
#include "sdk/io/terminal.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

void check_options(const HandEyeCommand& command) {
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
    if (command.offset_s && command.max_offset_s)
        throw CliError(ExitCode::kUsage,
                       "an offset that is known is not searched; give either --offset or "
                       "--max-offset.");
}

// 0: the library's default.
double degrees_or_default(const std::optional<double>& degrees) {
    return degrees.value_or(0) * kDegree;
}

defrec_hand_eye_desc desc_of(const HandEyeCommand& command, const PoseFile& camera,
                             const PoseFile& tracker) {
    auto desc = initialised<defrec_hand_eye_desc>();
    if (command.is_paired) desc.flags |= DEFREC_HAND_EYE_PAIRED;
    if (command.offset_s) desc.flags |= DEFREC_HAND_EYE_KNOWN_OFFSET;
    desc.camera_poses = camera.poses.data();
    desc.camera_times_s = camera.times_s.data();
    desc.camera_count = camera.count();
    desc.tracker_poses = tracker.poses.data();
    desc.tracker_times_s = tracker.times_s.data();
    desc.tracker_count = tracker.count();
    desc.camera_error_mm = command.camera_error_mm.value_or(0);
    desc.camera_error_rad = degrees_or_default(command.camera_error_degrees);
    desc.tracker_error_mm = command.tracker_error_mm.value_or(0);
    desc.tracker_error_rad = degrees_or_default(command.tracker_error_degrees);
    desc.offset_s = command.offset_s.value_or(0);
    desc.max_offset_s = command.max_offset_s.value_or(0);
    desc.max_residual_mm = command.max_residual_mm.value_or(0);
    desc.max_residual_rad = degrees_or_default(command.max_residual_degrees);
    desc.max_error_mm = command.max_error_mm.value_or(0);
    return desc;
}

void invert(PoseFile& file) {
    using Rows = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
    for (std::size_t i = 0; i < file.count(); ++i) {
        Eigen::Map<Rows> rows(&file.poses[12 * i]);
        Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
        pose.matrix().topRows<3>() = rows;
        rows = pose.inverse().matrix().topRows<3>();
    }
}

// The poses, the right way round, and a note on what they were taken for.
PoseFile load(const std::string& path, std::optional<PoseUnit> unit, bool is_inverted,
              bool is_ordered, std::vector<std::string>& notes) {
    PoseFile file = read_timed_poses(path, unit, is_ordered);
    if (is_inverted) invert(file);
    if (!unit)
        notes.push_back(path + ": " +
                        (file.is_tum ? "a TUM trajectory; lengths were taken to be in "
                                     : "lengths were taken to be in ") +
                        name_of(file.unit) + ".");
    return file;
}

HandEyeFindings calibrate(const defrec_hand_eye_desc& desc) {
    HandEyeFindings findings;
    defrec_hand_eye hand_eye = nullptr;
    const defrec_status status = defrec_hand_eye_create(&desc, &hand_eye);
    if (status == DEFREC_ERROR_ARGUMENT)
        throw CliError(ExitCode::kInput, std::string(defrec_last_error()) + ".");
    require(status, ExitCode::kInternal, "calibrating");
    findings.hand_eye.reset(hand_eye);
    findings.info = initialised<defrec_hand_eye_info>();
    require(defrec_hand_eye_get(hand_eye, &findings.info), ExitCode::kInternal,
            "reading the result");
    return findings;
}

}  // namespace

int run_hand_eye(const HandEyeCommand& command) {
    check_options(command);
    keep_apart({command.camera_poses, command.tracker_poses}, {command.out});
    std::vector<std::string> notes;
    const bool is_ordered = !command.is_paired;
    const PoseFile camera = load(command.camera_poses, command.camera_unit,
                                 command.is_camera_inverted, is_ordered, notes),
                   tracker = load(command.tracker_poses, command.tracker_unit,
                                  command.is_tracker_inverted, is_ordered, notes);
    HandEyeFindings findings = calibrate(desc_of(command, camera, tracker));
    findings.notes = std::move(notes);
    for (const std::string_view note : split(findings.info.notes, '\n'))
        if (!note.empty()) findings.notes.emplace_back(note);
    const std::string json = json_text(hand_eye_json(findings), 2) + "\n";
    if (!command.out.empty()) write_atomically(command.out, json);
    if (!command.quiet) print(command.json ? json : hand_eye_text(findings));
    return static_cast<int>(findings.is_solved() ? ExitCode::kOk : ExitCode::kFound);
}

}  // namespace defrec::cli
