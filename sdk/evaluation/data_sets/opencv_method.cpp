// The baseline: OpenCV's StereoSGBM and Lucas-Kanade.
#include "sdk/evaluation/data_sets/opencv_method.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/input/view_image.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/text.hpp"
#include "sdk/session/points.hpp"
#include "sdk/session/track_outputs.hpp"

namespace defrec::cli {
namespace {

constexpr double kNearestMm = 20;  // the nearest surface that the library expects by default

struct Camera {
    cv::Mat matrix, distortion;
};
Camera camera_of(const CameraCalibration& camera) {
    return {(cv::Mat_<double>(3, 3) << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1),
            cv::Mat(camera.distortion, true)};
}

// Rectification and disparity of one rig.
class Stereo {
  public:
    explicit Stereo(const StereoCalibration& calibration)
        : size_(calibration.width, calibration.height), left_(camera_of(calibration.left)) {
        const Camera right = camera_of(calibration.right);
        const cv::Mat rotation(3, 3, CV_64F, const_cast<double*>(calibration.rotation.data()));
        const cv::Mat translation(3, 1, CV_64F,
                                  const_cast<double*>(calibration.translation.data()));
        cv::Mat r2, p2, q;
        cv::stereoRectify(left_.matrix, left_.distortion, right.matrix, right.distortion, size_,
                          rotation, translation, r1_, r2, p1_, p2, q, cv::CALIB_ZERO_DISPARITY, 0);
        cv::initUndistortRectifyMap(left_.matrix, left_.distortion, r1_, p1_, size_, CV_32FC1,
                                    left_x_, left_y_);
        cv::initUndistortRectifyMap(right.matrix, right.distortion, r2, p2, size_, CV_32FC1,
                                    right_x_, right_y_);
        focal_ = p1_.at<double>(0, 0);
        centre_ = {p1_.at<double>(0, 2), p1_.at<double>(1, 2)};
        focal_baseline_ = -p2.at<double>(0, 3);
        constexpr int kStep = 16, kMaxDisparities = 512, kBlock = 5, kArea = kBlock * kBlock;
        const int disparities =
            std::clamp(kStep * static_cast<int>(std::ceil(focal_baseline_ / kNearestMm / kStep)),
                       kStep, std::min(kMaxDisparities, size_.width / 2 / kStep * kStep));
        matcher_ = cv::StereoSGBM::create(0, disparities, kBlock, 8 * kArea, 32 * kArea, 1, 63, 10,
                                          100, 2);
    }

    void set(const StereoFrame& frame) {
        cv::Mat right, units;
        cv::remap(gray_of(frame.left), gray_, left_x_, left_y_, cv::INTER_LINEAR);
        cv::remap(gray_of(frame.right), right, right_x_, right_y_, cv::INTER_LINEAR);
        // OpenCV leaves out as many columns on the left as it searches disparities.
        const int margin = matcher_->getNumDisparities();
        cv::Mat wide_left, wide_right;
        cv::copyMakeBorder(gray_, wide_left, 0, 0, margin, 0, cv::BORDER_REPLICATE);
        cv::copyMakeBorder(right, wide_right, 0, 0, margin, 0, cv::BORDER_REPLICATE);
        matcher_->compute(wide_left, wide_right, units);
        units = units.colRange(margin, units.cols);
        constexpr double kUnitsPerPx = cv::StereoMatcher::DISP_SCALE;
        units.convertTo(disparity_, CV_32F, 1 / kUnitsPerPx);
    }

    // Image, focal length and centre of the rectified left view.
    const cv::Mat& gray() const { return gray_; }
    double focal() const { return focal_; }
    cv::Point2d centre() const { return centre_; }
    cv::Size size() const { return size_; }

    std::vector<cv::Point2f> rectified(const std::vector<cv::Point2f>& raw) const {
        std::vector<cv::Point2f> pixels;
        if (!raw.empty())
            cv::undistortPoints(raw, pixels, left_.matrix, left_.distortion, r1_, p1_);
        return pixels;
    }

    // mm in the rectified left camera; z is 0 where there is none.
    cv::Point3d point_at(cv::Point2f pixel) const {
        const int u = cvRound(pixel.x), v = cvRound(pixel.y);
        if (u < 0 || v < 0 || u >= size_.width || v >= size_.height) return {};
        const float disparity = disparity_.at<float>(v, u);
        if (!(disparity > 0)) return {};
        const double z = focal_baseline_ / disparity;
        return {(pixel.x - centre_.x) / focal_ * z, (pixel.y - centre_.y) / focal_ * z, z};
    }

    cv::Point3d in_raw_camera(const cv::Point3d& point) const {
        const cv::Mat raw = r1_.t() * (cv::Mat_<double>(3, 1) << point.x, point.y, point.z);
        return {raw.at<double>(0), raw.at<double>(1), raw.at<double>(2)};
    }

    cv::Point2d in_raw_image(const cv::Point3d& point) const {
        std::vector<cv::Point2d> pixel;
        cv::projectPoints(std::vector<cv::Point3d>{in_raw_camera(point)}, cv::Vec3d(), cv::Vec3d(),
                          left_.matrix, left_.distortion, pixel);
        return pixel.front();
    }

    // The third component of in_raw_camera().
    double raw_depth(const cv::Point3d& point) const {
        return r1_.at<double>(0, 2) * point.x + r1_.at<double>(1, 2) * point.y +
               r1_.at<double>(2, 2) * point.z;
    }

  private:
    cv::Size size_;
    Camera left_;
    cv::Mat r1_, p1_, left_x_, left_y_, right_x_, right_y_, gray_, disparity_;
    double focal_ = 0, focal_baseline_ = 0;
    cv::Point2d centre_;
    cv::Ptr<cv::StereoSGBM> matcher_;
};

class OpenCvMeter : public DepthMeter {
  public:
    explicit OpenCvMeter(const StereoCalibration& calibration) : stereo_(calibration) {
        std::vector<cv::Point2f> raw;
        for (int v = 0; v < stereo_.size().height; ++v)
            for (int u = 0; u < stereo_.size().width; ++u)
                raw.emplace_back(static_cast<float>(u), static_cast<float>(v));
        rectified_ = stereo_.rectified(raw);
    }

    cv::Mat depth_of(const StereoFrame& frame) override {
        stereo_.set(frame);
        cv::Mat depth(stereo_.size(), CV_32F, cv::Scalar(0));
        for (std::size_t i = 0; i < rectified_.size(); ++i) {
            const cv::Point3d point = stereo_.point_at(rectified_[i]);
            if (point.z > 0) depth.ptr<float>()[i] = static_cast<float>(stereo_.raw_depth(point));
        }
        return depth;
    }

  private:
    Stereo stereo_;
    std::vector<cv::Point2f> rectified_;  // of each pixel of the left image
};

class StillMeter : public DepthMeter {
  public:
    explicit StillMeter(const StereoCalibration& calibration) : meter_(calibration) {}

    cv::Mat depth_of(const StereoFrame& frame) override {
        if (depth_.empty()) depth_ = meter_.depth_of(frame);
        return depth_;
    }

  private:
    OpenCvMeter meter_;
    cv::Mat depth_;
};

// Follows points in the rectified left images, or leaves them where they were.
class LucasKanade {
  public:
    LucasKanade(const TrackOptions& options, const std::filesystem::path& out, bool is_still)
        : is_still_(is_still),
          source_(options.source),
          stereo_(calibration_of(options, source_)),
          followed_(options.points.empty()
                        ? grid_points(source_.width(), source_.height())
                        : read_points(options.points, source_.width(), source_.height())),
          out_(out),
          points_(out / "points.csv"),
          frames_(out / kFrameTimesFile) {
        std::vector<cv::Point2f> raw;
        for (const FollowedPoint& point : followed_)
            raw.emplace_back(static_cast<float>(point.u), static_cast<float>(point.v));
        place_ = stereo_.rectified(raw);
        is_lost_.assign(place_.size(), false);
        first_.resize(place_.size());
    }

    void run() {
        points_.write("frame,timestamp_ms,id,x,y,z,u,v,status,expected_error_mm\n");
        frames_.write("frame,frame_ms\n");
        StereoFrame frame;
        while (source_.next(frame)) {
            const auto start = std::chrono::steady_clock::now();
            stereo_.set(frame);
            if (!before_.empty() && !is_still_) follow(frame.index);
            before_ = stereo_.gray().clone();
            const std::chrono::duration<double, std::milli> time =
                std::chrono::steady_clock::now() - start;
            write_rows(frame);
            frames_.write(std::to_string(frame.index) + "," + format_fixed(time.count(), 3) + "\n");
        }
        if (!source_.fault().empty()) throw CliError(ExitCode::kInput, source_.fault());
        points_.commit();
        frames_.commit();
        write_summary();
    }

  private:
    static StereoCalibration calibration_of(const TrackOptions& options,
                                            const FrameSource& source) {
        StereoCalibration calibration = load_calibration(options.calibration, options.units);
        fit_to_frames(calibration, source.width(), source.height());
        return calibration;
    }

    // Points whose frame has come before this one.
    void follow(std::int64_t frame) {
        constexpr float kMaxReturn = 1;  // px
        std::vector<std::size_t> which;
        std::vector<cv::Point2f> from, to, back;
        for (std::size_t i = 0; i < place_.size(); ++i) {
            if (is_lost_[i] || followed_[i].frame.value_or(0) >= frame) continue;
            which.push_back(i);
            from.push_back(place_[i]);
        }
        if (from.empty()) return;
        std::vector<unsigned char> found, found_back;
        std::vector<float> ignored;
        cv::calcOpticalFlowPyrLK(before_, stereo_.gray(), from, to, found, ignored);
        cv::calcOpticalFlowPyrLK(stereo_.gray(), before_, to, back, found_back, ignored);
        for (std::size_t i = 0; i < which.size(); ++i) {
            const cv::Point2f error = back[i] - from[i];
            const bool is_kept =
                found[i] != 0 && found_back[i] != 0 && std::hypot(error.x, error.y) <= kMaxReturn;
            if (is_kept)
                place_[which[i]] = to[i];
            else
                is_lost_[which[i]] = true;
        }
    }

    // z is 0 where there is none.
    cv::Point3d point_of(std::size_t i) {
        if (is_still_ && first_[i].z > 0) return first_[i];
        if (is_lost_[i]) return {};
        const cv::Point3d point = stereo_.point_at(place_[i]);
        first_[i] = point;
        return point;
    }

    void write_rows(const StereoFrame& frame) {
        constexpr int kMm = 4, kPx = 3;
        for (std::size_t i = 0; i < place_.size(); ++i) {
            if (followed_[i].frame.value_or(0) > frame.index) continue;
            std::string line = std::to_string(frame.index);
            line += ',';
            append_fixed(line, frame.timestamp_ms, kPx);
            line += ',';
            append_integer(line, followed_[i].id);
            const cv::Point3d point = point_of(i);
            if (point.z > 0) {
                const cv::Point2d pixel = stereo_.in_raw_image(point);
                for (const double value : {point.x, point.y, point.z}) {
                    line += ',';
                    append_fixed(line, value, kMm);
                }
                for (const double value : {pixel.x, pixel.y}) {
                    line += ',';
                    append_fixed(line, value, kPx);
                }
                line.append(",").append(name_of(PointStatus::kTracked)).append(",\n");
            } else {
                line.append(",,,,,,").append(name_of(PointStatus::kLost)).append(",\n");
            }
            points_.write(line);
        }
    }

    void write_summary() {
        const nlohmann::ordered_json json = {{"rectified_camera",
                                              {{"fx", stereo_.focal()},
                                               {"fy", stereo_.focal()},
                                               {"cx", stereo_.centre().x},
                                               {"cy", stereo_.centre().y}}}};
        write_atomically(out_ / "summary.json", json_text(json, 2) + "\n");
    }

    const bool is_still_;
    FrameSource source_;
    Stereo stereo_;
    std::vector<FollowedPoint> followed_;
    std::filesystem::path out_;
    AtomicFile points_, frames_;
    std::vector<cv::Point2f> place_;  // in the rectified left image
    std::vector<bool> is_lost_;
    std::vector<cv::Point3d> first_;  // mm, where a point that stays was seen
    cv::Mat before_;                  // the image before
};

}  // namespace

std::unique_ptr<DepthMeter> make_opencv_depth_meter(const StereoCalibration& calibration) {
    return std::make_unique<OpenCvMeter>(calibration);
}

std::unique_ptr<DepthMeter> make_still_depth_meter(const StereoCalibration& calibration) {
    return std::make_unique<StillMeter>(calibration);
}

void track_by_opencv(const TrackOptions& options, const std::filesystem::path& out) {
    LucasKanade(options, out, false).run();
}

void leave_points(const TrackOptions& options, const std::filesystem::path& out) {
    LucasKanade(options, out, true).run();
}

}  // namespace defrec::cli
