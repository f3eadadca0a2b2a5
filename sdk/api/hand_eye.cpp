// The exported functions for hand-eye calibrations: check, catch, forward.
#include "sdk/api/call.hpp"
#include "sdk/api/objects.hpp"
#include "sdk/api/read.hpp"

using namespace defrec;

namespace {

uint32_t verdict_of(HandEyeVerdict verdict) {
    switch (verdict) {
        case HandEyeVerdict::kSolved:
            return DEFREC_VERDICT_ACCEPTED;
        case HandEyeVerdict::kUndetermined:
            return DEFREC_VERDICT_UNDETERMINED;
        default:
            return DEFREC_VERDICT_FAILED;
    }
}

// times: empty where they do not matter.
std::vector<TimedPose> poses_of(std::span<const double> values, std::span<const double> times) {
    std::vector<TimedPose> poses(values.size() / 12);
    for (size_t i = 0; i < poses.size(); ++i) {
        poses[i].pose = affine_of(&values[12 * i]);
        poses[i].time_s = times.empty() ? static_cast<double>(i) : times[i];
    }
    return poses;
}

HandEyeOptions options_of(const defrec_hand_eye_desc& desc) {
    HandEyeOptions options;
    const int stated = (desc.camera_error_mm > 0) + (desc.camera_error_rad > 0) +
                       (desc.tracker_error_mm > 0) + (desc.tracker_error_rad > 0);
    if (stated != 0 && stated != 4)
        fail(DEFREC_ERROR_ARGUMENT, stated,
             " of the four errors in desc are given; all of them expected, or none");
    if (stated == 4)
        options.noise = {desc.camera_error_mm, desc.camera_error_rad, desc.tracker_error_mm,
                         desc.tracker_error_rad};
    options.is_paired = (desc.flags & DEFREC_HAND_EYE_PAIRED) != 0;
    if ((desc.flags & DEFREC_HAND_EYE_KNOWN_OFFSET) != 0) options.offset_s = desc.offset_s;
    options.max_offset_s = desc.max_offset_s;
    options.max_residual_mm = desc.max_residual_mm;
    options.max_residual_rad = desc.max_residual_rad;
    options.max_error_mm = desc.max_error_mm;
    options.max_offset_error_s = desc.max_offset_error_s;
    return options;
}

HandEyeCalibration calibrate(const defrec_hand_eye_desc& desc) {
    const HandEyeOptions options = options_of(desc);
    const auto times = [&](const char* name, const double* given, uint64_t count) {
        return options.is_paired ? read_optional(given, count, 1)
                                 : read_array(name, given, count, 1);
    };
    return calibrate_hand_eye(
        poses_of(read_array("desc.camera_poses", desc.camera_poses, desc.camera_count, 12),
                 times("desc.camera_times_s", desc.camera_times_s, desc.camera_count)),
        poses_of(read_array("desc.tracker_poses", desc.tracker_poses, desc.tracker_count, 12),
                 times("desc.tracker_times_s", desc.tracker_times_s, desc.tracker_count)),
        options);
}

void describe_quality(const HandEyeQuality& quality, defrec_hand_eye_info& info) {
    info.rms_mm = quality.rms_mm;
    info.rms_rad = quality.rms_rad;
    info.error_ratio = quality.error_ratio;
    info.camera_error_mm = quality.noise.camera_mm;
    info.camera_error_rad = quality.noise.camera_rad;
    info.tracker_error_mm = quality.noise.tracker_mm;
    info.tracker_error_rad = quality.noise.tracker_rad;
    info.correlated = quality.correlated;
    info.turn_rad = quality.turn_rad;
    info.cross_turn_rad = quality.cross_turn_rad;
    info.length_factor = quality.length_factor;
    info.length_factor_sigma = quality.length_factor_sigma;
    info.used = quality.poses;
    info.inlier_count = quality.inliers;
}

void describe(const HandEyeObject& object, defrec_hand_eye_info& info) {
    const HandEyeCalibration& found = object.found;
    info.struct_size = sizeof info;
    info.verdict = verdict_of(found.verdict);
    info.reason = found.reason.c_str();
    info.notes = object.notes.c_str();
    const HandEyeTransforms& transforms = found.transforms;
    write_motion(transforms.marker_from_camera.linear(),
                 transforms.marker_from_camera.translation(), info.marker_from_camera);
    write_motion(transforms.tracker_from_world.linear(),
                 transforms.tracker_from_world.translation(), info.tracker_from_world);
    write_matrix(found.covariance, info.covariance);
    const bool is_solved = !found.residual_mm.empty();
    info.is_solved = is_solved ? 1 : 0;
    info.offset_estimated = found.offset.is_estimated ? 1 : 0;
    info.offset_s = found.offset.offset_s;
    info.offset_sigma_s = found.offset.sigma_s;
    info.offset_correlation = found.offset.correlation;
    describe_quality(found.quality, info);
    info.residuals_mm = is_solved ? found.residual_mm.data() : nullptr;
    info.residuals_rad = is_solved ? found.residual_rad.data() : nullptr;
    info.inliers = is_solved ? found.is_inlier.data() : nullptr;
    info.residual_count = found.residual_mm.size();
    info.free_motion_count = found.open.size();
}

// For a calibration that was accepted.
std::vector<TimedPose> marker_poses(const HandEyeObject& object, const double* values,
                                    size_t count) {
    check_count(count);
    if (object.found.verdict != HandEyeVerdict::kSolved)
        fail(DEFREC_ERROR_STATE, "this calibration was not accepted: ", object.found.reason);
    std::vector<TimedPose> poses = poses_of(read_array("marker_pose", values, count, 12), {});
    check_poses(poses, "marker_pose");
    return poses;
}

}  // namespace

extern "C" {

defrec_status defrec_hand_eye_create(const defrec_hand_eye_desc* desc, defrec_hand_eye* out) {
    return api_call([&] {
        expect_given("out", out);
        auto object = std::make_shared<HandEyeObject>();
        object->found = calibrate(read_complete(desc));
        for (const std::string& note : object->found.notes)
            object->notes += (object->notes.empty() ? "" : "\n") + note;
        for (const HandEyeOpenMotion& open : object->found.open)
            object->free_texts.push_back(open.text());
        *out = add_handle<defrec_hand_eye>(std::move(object));
    });
}

void defrec_hand_eye_destroy(defrec_hand_eye hand_eye) {
    if (hand_eye != nullptr) api_call([&] { remove_handle(hand_eye); });
}

defrec_status defrec_hand_eye_get(defrec_hand_eye hand_eye, defrec_hand_eye_info* out) {
    return api_call([&] {
        const auto object = find_handle(hand_eye);
        defrec_hand_eye_info info{};
        describe(*object, info);
        write_struct(out, info);
    });
}

defrec_status defrec_hand_eye_get_free_motion(defrec_hand_eye hand_eye, size_t index,
                                              defrec_free_motion* out) {
    return api_call([&] {
        const auto object = find_handle(hand_eye);
        const std::vector<HandEyeOpenMotion>& motions = object->found.open;
        check_index(index, motions.size(), "free motions");
        const HandEyeOpenMotion& motion = motions[index];
        const Eigen::Vector3d place = object->found.transforms.marker_from_camera.translation();
        defrec_free_motion made{};
        made.struct_size = sizeof made;
        made.kind = motion.is_turn ? DEFREC_FREE_TURN : DEFREC_FREE_SHIFT;
        for (int axis = 0; axis < 3; ++axis) {
            made.axis[axis] = motion.axis[axis];
            made.point[axis] = motion.is_turn ? place[axis] : 0;
        }
        (motion.is_turn ? made.expected_rad : made.expected_mm) = motion.expected;
        made.text = object->free_texts[index].c_str();
        write_struct(out, made);
    });
}

defrec_status defrec_hand_eye_camera_pose(defrec_hand_eye hand_eye, const double* marker_pose,
                                          size_t count, double* camera_pose) {
    return api_call([&] {
        const auto object = find_handle(hand_eye);
        const std::vector<TimedPose> poses = marker_poses(*object, marker_pose, count);
        if (count != 0) expect_given("camera_pose", camera_pose);
        for (size_t i = 0; i < count; ++i) {
            const Eigen::Isometry3d pose =
                poses[i].pose * object->found.transforms.marker_from_camera;
            write_motion(pose.linear(), pose.translation(), camera_pose + 12 * i);
        }
    });
}

defrec_status defrec_hand_eye_pose_covariance(defrec_hand_eye hand_eye, const double* marker_pose,
                                              size_t count, double* pose_covariance) {
    return api_call([&] {
        const auto object = find_handle(hand_eye);
        const std::vector<TimedPose> poses = marker_poses(*object, marker_pose, count);
        if (count != 0) expect_given("pose_covariance", pose_covariance);
        for (size_t i = 0; i < count; ++i)
            write_matrix(object->found.pose_covariance(poses[i].pose), pose_covariance + 36 * i);
    });
}

}  // extern "C"
