// What the layouts share.
#include "sdk/scenes/writing/layout_writer.hpp"

#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "sdk/io/whole_video.hpp"

namespace defrec::cli {

namespace fs = std::filesystem;

void require_even_size(const RenderOptions& options) {
    if (options.width % 2 == 0 && options.height % 2 == 0) return;
    throw RenderUsageError("--layout " + options.layout + " writes a video; give an even size");
}

void require_rectified(const RenderOptions& options, const Scene& scene) {
    if (scene.info.rectified) return;
    throw RenderUsageError("scene '" + options.scene + "' has raw images; --layout " +
                           options.layout + " is for rectified scenes");
}

void make_folder(const fs::path& path) {
    std::error_code error;
    fs::create_directories(path, error);
    if (error) throw RenderOutputError("cannot create " + path.string() + ": " + error.message());
}

void make_new_folder(const fs::path& path) {
    std::error_code error;
    if (fs::exists(path, error) && !fs::is_empty(path, error))
        throw RenderUsageError(path.string() +
                               " holds files already, which would pass for frames of this "
                               "sequence; remove them or choose another folder with --out");
    make_folder(path);
}

void write_image(const fs::path& path, const cv::Mat& image, const std::vector<int>& parameters) {
    std::vector<unsigned char> bytes;
    cv::imencode(path.extension().string(), image, bytes, parameters);
    write_atomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

cv::Mat picture_of(const std::vector<std::uint8_t>& bgr, cv::Size size) {
    return {size.height, size.width, CV_8UC3, const_cast<std::uint8_t*>(bgr.data())};
}

cv::Point2d place_in_right(const StereoRig& rig, const Eigen::Vector3d& in_left) {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    const Eigen::Vector2d pixel = rig.right.project(rig.rotation * in_left + rig.translation);
    const bool is_inside = pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= rig.width - 1 &&
                           pixel.y() <= rig.height - 1;
    return is_inside ? cv::Point2d(pixel.x(), pixel.y()) : cv::Point2d(kNone, kNone);
}

VideoFile::VideoFile(const fs::path& path, cv::Size size) : file_(path) {
    constexpr double kFps = 1000.0 / kFrameMs;
    if (!video_.open(file_.temporary().string(), cv::CAP_FFMPEG,
                     cv::VideoWriter::fourcc('m', 'p', '4', 'v'), kFps, size))
        throw RenderOutputError("cannot encode a video: this OpenCV has no encoder for it");
}

void VideoFile::finish() {
    video_.release();
    if (readable_frames(file_.temporary().string()) != frames_)
        throw RenderOutputError("cannot write '" + file_.path().string() +
                                "': the video is incomplete; is the disk full?");
    file_.commit();
}

}  // namespace defrec::cli
