// For tests: an image with detail of every size down to its pixels.
#pragma once

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace defrec::cli {

// Noise of octaves that are as strong as they are coarse, and a camera's own.
inline cv::Mat texture(int width, int height, double contrast = 4) {
    cv::RNG random(5);
    cv::Mat sum(height, width, CV_32F, cv::Scalar(120));
    for (int px = 1; px <= 16; px *= 2) {
        cv::Mat noise(height / px, width / px, CV_32F), octave;
        random.fill(noise, cv::RNG::NORMAL, 0, contrast * (px > 1 ? 1 : 0.3));
        cv::resize(noise, octave, sum.size(), 0, 0, cv::INTER_CUBIC);
        sum += octave;
    }
    cv::Mat gray;
    sum.convertTo(gray, CV_8U);
    return gray;
}

inline cv::Mat magnified(const cv::Mat& image, int times) {
    cv::Mat large;
    cv::resize(image, large, {}, times, times, cv::INTER_CUBIC);
    return large;
}

}  // namespace defrec::cli
