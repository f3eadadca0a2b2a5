// See bag_calibration.hpp.
#include "sdk/input/bag_calibration.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "sdk/bag/bag.hpp"
#include "sdk/bag/ros_messages.hpp"
#include "sdk/bag/stereo_topics.hpp"
#include "sdk/io/decisions.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/ros_calibration.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr char kGiveFile[] = " Give the calibration with --calibration.";

[[noreturn]] void fail(const std::string& origin, const std::string& message) {
    throw CliError(ExitCode::kCalibration, origin + ": " + message + kGiveFile);
}

// Binning and regions: the image would have other pixels than the calibration.
void require_whole_image(const RosCameraInfo& info, const std::string& origin) {
    const bool is_binned = info.binning_x > 1 || info.binning_y > 1;
    const bool is_part = info.roi_x != 0 || info.roi_y != 0 ||
                         (info.roi_width != 0 && info.roi_width != info.width) ||
                         (info.roi_height != 0 && info.roi_height != info.height);
    if (is_binned || is_part)
        fail(origin,
             "the images are binned, or a part of the sensor's (binning, roi), which is not "
             "supported.");
}

void require_distortion(const RosCameraInfo& info, const std::string& origin) {
    check_distortion_model(std::string(info.distortion_model), origin + ".distortion_model");
    const std::string fault = fault_of_distortion(info.d.size());
    if (!fault.empty()) fail(origin + ".D", fault);
}

// is_rectified: the images are, so that P alone describes their camera.
RosCamera camera_of(const RosCameraInfo& info, bool is_rectified, const std::string& origin) {
    constexpr std::uint32_t kLargestSide = decisions::CalibrationFile::kMaxImageSide;
    if (info.k[0] == 0 || info.p[0] == 0)
        fail(origin, "it is of a camera that was not calibrated: " +
                         std::string(info.k[0] == 0 ? "K" : "P") + " is 0.");
    if (std::max(info.width, info.height) > kLargestSide)
        fail(origin, "the size " + std::to_string(info.width) + "x" + std::to_string(info.height) +
                         " is beyond " + std::to_string(kLargestSide) + ".");
    require_whole_image(info, origin);
    RosCamera camera;
    camera.width = static_cast<int>(info.width);
    camera.height = static_cast<int>(info.height);
    camera.size_origin = origin + ".width";
    camera.projection = info.p;
    camera.projection_origin = origin + ".P";
    camera.rectification_origin = origin + ".R";
    if (is_rectified) {
        const std::array<double, 12>& p = info.p;
        set_camera_matrix({p[0], p[1], p[2], p[4], p[5], p[6], p[8], p[9], p[10]}, origin + ".P",
                          camera.camera);
        return camera;
    }
    require_distortion(info, origin);
    set_camera_matrix({info.k.begin(), info.k.end()}, origin + ".K", camera.camera);
    camera.camera.distortion = info.d;
    camera.camera.distortion_origin = origin + ".D";
    camera.rectification = info.r;
    return camera;
}

// The first camera_info of either view; left first.
std::array<RosCamera, 2> cameras_of(const BagOptions& options) {
    const auto files = files_of_bag(options.path);
    const std::vector<BagTopic> topics = topics_of_bag(files);
    const StereoTopics views = views_of(options, topics);
    if (!views.right)
        fail(options.path, "each image of topic " + views.left.name +
                               " holds both views, and a camera_info is of one camera.");
    const std::array<std::string, 2> images = {views.left.name, views.right->name};
    std::array<std::string, 2> names;
    for (std::size_t view = 0; view < names.size(); ++view) {
        names[view] = camera_info_topic(images[view]);
        const bool is_there = std::any_of(topics.begin(), topics.end(), [&](const BagTopic& topic) {
            return topic.name == names[view] && topic.type == kCameraInfoType &&
                   topic.encoding == "cdr" && topic.messages > 0;
        });
        if (!is_there)
            fail(options.path, "it has no camera_info of topic " + images[view] + "; " +
                                   names[view] + " of type " + std::string(kCameraInfoType) +
                                   " was expected.");
    }
    std::array<std::optional<RosCamera>, 2> cameras;
    BagMessages messages(files);
    BagMessage message;
    while (!(cameras[0] && cameras[1]) && messages.next(message))
        for (std::size_t view = 0; view < names.size(); ++view) {
            if (message.topic->name != names[view] || cameras[view]) continue;
            const std::string origin = options.path + ": " + names[view];
            const std::optional<RosCameraInfo> info = read_camera_info(message.data);
            if (!info) fail(origin, "it is no " + std::string(kCameraInfoType) + " in CDR.");
            cameras[view] = camera_of(*info, is_rectified_topic(images[view]), origin);
        }
    if (!cameras[0] || !cameras[1])
        fail(options.path, "its camera_info could not be read. " + messages.fault());
    return {std::move(*cameras[0]), std::move(*cameras[1])};
}

// The bag's own is asked for.
bool is_of_bag(const SourceOptions& source, const std::string& file) {
    return file.empty() && source.bag.is_given();
}

}  // namespace

WrittenCalibration written_calibration(const SourceOptions& source, const std::string& file) {
    if (!is_of_bag(source, file)) return written_calibration(file);
    const auto [left, right] = cameras_of(source.bag);
    return {rig_of(left, right), LengthUnit::kMetre};
}

std::string calibration_name(const SourceOptions& source, const std::string& file) {
    return is_of_bag(source, file) ? "camera_info of " + source.bag.path : file;
}

}  // namespace defrec::cli
