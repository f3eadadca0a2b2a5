// For tests: recordings that are spoiled in one way each.
#pragma once

#include <algorithm>
#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "sdk/doctor/doctor.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/scenes/writing/h264_pass.hpp"

namespace defrec::cli {

struct Recording {
    std::vector<cv::Mat> left, right;  // BGR
    StereoCalibration calibration;
};

inline std::vector<cv::Mat> read_images(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    std::vector<cv::Mat> images;
    for (const auto& file : files) images.push_back(cv::imread(file.string()));
    return images;
}

inline Recording read_recording(const std::filesystem::path& folder) {
    return {read_images(folder / "left"), read_images(folder / "right"),
            load_calibration((folder / "calibration.yaml").string())};
}

inline void write_recording(const Recording& recording, const std::filesystem::path& folder) {
    for (const auto& [name, images] :
         {std::pair("left", &recording.left), std::pair("right", &recording.right)}) {
        std::filesystem::create_directories(folder / name);
        for (std::size_t i = 0; i < images->size(); ++i)
            cv::imwrite((folder / name / (std::to_string(1000 + i) + ".png")).string(),
                        (*images)[i], {cv::IMWRITE_PNG_COMPRESSION, 1});
    }
    const StereoCalibration& c = recording.calibration;
    cv::FileStorage file((folder / "calibration.yaml").string(), cv::FileStorage::WRITE);
    if (c.width > 0) file << "image_width" << c.width << "image_height" << c.height;
    for (const auto& [number, camera] : {std::pair("1", &c.left), std::pair("2", &c.right)}) {
        file << std::string("M") + number
             << cv::Mat(cv::Matx33d(camera->fx, 0, camera->cx, 0, camera->fy, camera->cy, 0, 0, 1));
        if (!camera->distortion.empty())
            file << std::string("D") + number << cv::Mat(camera->distortion);
    }
    file << "R" << cv::Mat(cv::Matx33d(c.rotation.data()));
    file << "T" << cv::Mat(cv::Vec3d(c.translation.data()));
}

using Spoil = std::function<void(Recording&)>;

inline void for_each_image(Recording& recording, const std::function<void(cv::Mat&)>& change) {
    for (std::vector<cv::Mat>* images : {&recording.left, &recording.right})
        for (cv::Mat& image : *images) change(image);
}

// As a codec of 8 x 8 blocks leaves it.
inline void compress(cv::Mat& image, int quality) {
    std::vector<std::uint8_t> bytes;
    cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
    image = cv::imdecode(bytes, cv::IMREAD_COLOR);
}

// Each view through H.264 and back, as scene "compressed" is.
inline void encode(Recording& recording, double contrast) {
    const TestFolder folder;
    for (std::vector<cv::Mat>* images : {&recording.left, &recording.right}) {
        H264Pass pass(folder.path() / "view.mp4", images->front().size(), contrast);
        for (const cv::Mat& image : *images) pass.write(image);
        pass.end_writing();
        for (cv::Mat& image : *images) image = pass.read();
    }
}

inline void scale_calibration(StereoCalibration& calibration, double scale) {
    for (CameraCalibration* camera : {&calibration.left, &calibration.right}) {
        camera->fx *= scale;
        camera->fy *= scale;
        camera->cx = (camera->cx + 0.5) * scale - 0.5;
        camera->cy = (camera->cy + 0.5) * scale - 0.5;
    }
}

// Every other row of an image is of the one before.
inline void interlace(std::vector<cv::Mat>& images) {
    for (std::size_t i = images.size() - 1; i > 0; --i) {
        images[i] = images[i].clone();
        for (int y = 1; y < images[i].rows; y += 2) images[i - 1].row(y).copyTo(images[i].row(y));
    }
}

// Columns from `first` on.
inline void crop(std::vector<cv::Mat>& images, int first, int width) {
    for (cv::Mat& image : images) image = image.colRange(first, first + width).clone();
}

// Surroundings of an endoscope's picture: a round aperture, black borders, text.
inline void dress(cv::Mat& image) {
    cv::Mat aperture(image.size(), CV_8U, cv::Scalar(0));
    cv::circle(aperture, {image.cols / 2, image.rows / 2}, image.rows * 11 / 20, 255, cv::FILLED);
    cv::Mat dressed(image.size(), image.type(), cv::Scalar::all(0));
    image.copyTo(dressed, aperture);
    cv::putText(dressed, "12:30:05 EXP AUTO", {image.cols / 4, image.rows / 6},
                cv::FONT_HERSHEY_SIMPLEX, image.rows / 500.0, {240, 240, 240}, 1);
    image = dressed;
}

inline DoctorOptions options_for(const std::filesystem::path& folder) {
    DoctorOptions options;
    options.source.left = (folder / "left").string();
    options.source.right = (folder / "right").string();
    options.calibration = (folder / "calibration.yaml").string();
    options.probe.backend = "cpu";
    return options;
}

// The ids of what was found, with a blank between them.
inline std::string found_in(const Diagnosis& diagnosis) {
    std::string ids;
    for (const Finding& finding : diagnosis.findings)
        if (finding.verdict == Verdict::kFound) ids += (ids.empty() ? "" : " ") + finding.id;
    return ids;
}

}  // namespace defrec::cli
