// Depth of stereo images, by the library; and its errors.
#include "sdk/evaluation/data_sets/depth_meter.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "sdk/client/library.hpp"
#include "sdk/client/tracker_config.hpp"
#include "sdk/evaluation/data_sets/opencv_method.hpp"
#include "sdk/evaluation/score/percentile.hpp"

namespace defrec::cli {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

bool is_known(float depth) { return std::isfinite(depth) && depth > 0; }

class LibraryMeter : public DepthMeter {
  public:
    LibraryMeter(const RunSettings& settings, const StereoCalibration& calibration, int channels)
        : context_(open_context({settings.threads, true, {}})),
          device_(choose_device(context_, settings.backend, settings.device)),
          rig_(make_rig(context_, calibration)),
          info_(rig_info(rig_)),
          size_(calibration.width, calibration.height) {
        auto desc = initialised<defrec_tracker_desc>();
        if (!settings.config.empty()) read_config(settings.config, desc);
        desc.seed = settings.seed;
        desc.format = format_of_channels(channels);
        desc.device_id = device_.id.c_str();
        desc.keep_disparity = 1;
        defrec_tracker tracker = nullptr;
        require(defrec_tracker_create(context_.get(), rig_.get(), &desc, &tracker),
                settings.config.empty() ? ExitCode::kInternal : ExitCode::kUsage,
                "creating the tracker");
        tracker_.reset(tracker);
        rectify_pixels();
    }

    cv::Mat depth_of(const StereoFrame& frame) override {
        const Job job = submit(tracker_, frame);
        const defrec_result result = result_of(job, frame.index);
        cv::Mat depth(size_, CV_32F, cv::Scalar(0));
        if (result.disparity == nullptr) return depth;
        for (int v = 0; v < size_.height; ++v)
            for (int u = 0; u < size_.width; ++u)
                depth.at<float>(v, u) = depth_at(result.disparity, u, v);
        return depth;
    }

  private:
    void rectify_pixels() {
        rectified_.reserve(2 * static_cast<std::size_t>(size_.area()));
        for (int v = 0; v < size_.height; ++v)
            for (int u = 0; u < size_.width; ++u)
                rectified_.insert(rectified_.end(), {double(u), double(v)});
        require(defrec_rig_rectify_pixels(rig_.get(), rectified_.data(), rectified_.size() / 2,
                                          rectified_.data()),
                ExitCode::kInternal, "mapping pixels");
    }

    float depth_at(const std::int16_t* disparity, int u, int v) const {
        const double* pixel =
            rectified_.data() + 2 * (static_cast<std::size_t>(v) * size_.width + u);
        if (!std::isfinite(pixel[0]) || !std::isfinite(pixel[1])) return 0;
        const long column = std::lround(pixel[0]), row = std::lround(pixel[1]);
        if (column < 0 || row < 0 || column >= long(info_.width) || row >= long(info_.height))
            return 0;
        const int units = disparity[row * long(info_.width) + column];
        if (units == DEFREC_DISPARITY_NONE) return 0;
        const defrec_camera& camera = info_.camera;
        constexpr double kOne = DEFREC_DISPARITY_ONE;
        const double whole = units + kOne * camera.disparity_offset_px;
        if (whole <= 0) return 0;
        const double z = camera.fx * camera.baseline_mm * kOne / whole;
        const double x = (pixel[0] - camera.cx) / camera.fx * z;
        const double y = (pixel[1] - camera.cy) / camera.fy * z;
        // The last row of the inverse of rotation: x_rectified = rotation * x_left.
        return static_cast<float>(info_.rotation[2] * x + info_.rotation[5] * y +
                                  info_.rotation[8] * z);
    }

    Context context_;
    Device device_;
    Rig rig_;
    defrec_rig_info info_;
    cv::Size size_;
    Tracker tracker_;
    std::vector<double> rectified_;  // u, v of each pixel of the left image
};

}  // namespace

std::unique_ptr<DepthMeter> make_depth_meter(const RunSettings& settings,
                                             const StereoCalibration& calibration, int channels) {
    if (settings.method == Method::kOpenCv) return make_opencv_depth_meter(calibration);
    if (settings.method == Method::kStill) return make_still_depth_meter(calibration);
    return std::make_unique<LibraryMeter>(settings, calibration, channels);
}

StereoFrame frame_of(const cv::Mat& left, const cv::Mat& right, std::int64_t index) {
    constexpr double kFrameMs = 1000.0 / 30;
    const auto view = [](const cv::Mat& image) {
        return ImageView{image.data, image.cols, image.rows, image.channels(), image.step[0]};
    };
    auto pixels = std::make_shared<const std::pair<cv::Mat, cv::Mat>>(left, right);
    return {index, kFrameMs * static_cast<double>(index), view(pixels->first), view(pixels->second),
            pixels};
}

cv::Mat read_image(const std::filesystem::path& path, int flags) {
    cv::Mat image;
    try {
        image = cv::imread(path.string(), flags);
    } catch (const cv::Exception&) {
        image.release();
    }
    if (image.empty()) {
        throw CliError(ExitCode::kInput,
                       path.string() + ": this is not a whole image that can be read.");
    }
    return image;
}

DepthErrors errors_of(const cv::Mat& truth, const cv::Mat& depth) {
    std::vector<double> errors;
    std::size_t known = 0;
    double sum = 0;
    for (int v = 0; v < truth.rows; ++v) {
        for (int u = 0; u < truth.cols; ++u) {
            const float true_depth = truth.at<float>(v, u), found = depth.at<float>(v, u);
            if (!is_known(true_depth)) continue;
            ++known;
            if (!is_known(found)) continue;
            errors.push_back(std::abs(double(found) - double(true_depth)));
            sum += errors.back();
        }
    }
    std::sort(errors.begin(), errors.end());
    const auto count = static_cast<double>(errors.size());
    return {static_cast<double>(known) / static_cast<double>(truth.total()),
            known > 0 ? count / static_cast<double>(known) : kNone,
            errors.empty() ? kNone : sum / count, percentile(errors, 0.5)};
}

std::string error_picture(const cv::Mat& left, const cv::Mat& truth, const cv::Mat& depth) {
    constexpr int kMaxWidth = 480, kQuality = 80;
    constexpr double kRedMm = 5, kErrorWeight = 0.6;
    cv::Mat picture = left.clone();
    if (picture.channels() == 1) cv::cvtColor(picture, picture, cv::COLOR_GRAY2BGR);
    cv::Mat levels(picture.size(), CV_8U, cv::Scalar(0)), mask = levels.clone(), colours, mixed;
    for (int v = 0; v < picture.rows; ++v) {
        for (int u = 0; u < picture.cols; ++u) {
            const float true_depth = truth.at<float>(v, u), found = depth.at<float>(v, u);
            if (!is_known(true_depth) || !is_known(found)) continue;
            mask.at<std::uint8_t>(v, u) = 255;
            levels.at<std::uint8_t>(v, u) =
                cv::saturate_cast<std::uint8_t>(255 / kRedMm * std::abs(found - true_depth));
        }
    }
    cv::applyColorMap(levels, colours, cv::COLORMAP_JET);
    cv::addWeighted(colours, kErrorWeight, picture, 1 - kErrorWeight, 0, mixed);
    mixed.copyTo(picture, mask);
    const double scale = std::min(1.0, static_cast<double>(kMaxWidth) / picture.cols);
    cv::resize(picture, picture, {}, scale, scale, cv::INTER_AREA);
    std::vector<unsigned char> bytes;
    cv::imencode(".jpg", picture, bytes, {cv::IMWRITE_JPEG_QUALITY, kQuality});
    return {bytes.begin(), bytes.end()};
}

}  // namespace defrec::cli
