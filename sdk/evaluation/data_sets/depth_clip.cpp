// A clip of which depth is measured frame by frame.
#include "sdk/evaluation/data_sets/depth_clip.hpp"

#include <algorithm>
#include <chrono>
#include <opencv2/imgcodecs.hpp>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/input/view_image.hpp"
#include "sdk/io/output_folder.hpp"

namespace defrec::cli {

DepthClip::DepthClip(const ClipTask& task, const DataSet& data_set)
    : task_(task), score_{Samples(data_set.sample_columns()), 0, {}, {}, {}} {
    create_output_folder(task.out / "depth");
}

void DepthClip::begin(const StereoCalibration& calibration, int channels) {
    meter_ = make_depth_meter(task_.settings, calibration, channels);
}

cv::Mat DepthClip::measure(const StereoFrame& frame) {
    const auto start = std::chrono::steady_clock::now();
    cv::Mat depth = meter_->depth_of(frame);
    times_.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
            .count());
    return depth;
}

void DepthClip::write(std::int64_t frame, const cv::Mat& depth) const {
    std::vector<unsigned char> bytes;
    cv::imencode(".tiff", depth, bytes);
    std::string name = std::to_string(frame);
    name.insert(0, 6 - std::min<std::size_t>(6, name.size()), '0');
    write_atomically(task_.out / "depth" / (name + ".tiff"),
                     {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

void DepthClip::consider(double error, const StereoFrame& frame, const cv::Mat& truth,
                         const cv::Mat& depth, const std::string& remark) {
    if (!(error > worst_)) return;
    worst_ = error;
    score_.picture = error_picture(mat_of(frame.left), truth, depth);
    score_.remark = remark + "; blue: 0, red: 5 mm off";
}

ClipScore DepthClip::finish() {
    score_.frames = static_cast<std::int64_t>(times_.size());
    score_.frame_ms = frame_times_of(std::move(times_));
    return std::move(score_);
}

}  // namespace defrec::cli
