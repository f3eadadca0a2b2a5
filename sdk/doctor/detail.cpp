// See detail.hpp. Energy by octaves of a Laplacian pyramid: P. J. Burt, E. H. Adelson, The
// Laplacian pyramid as a compact image code, IEEE Trans. Communications 31 (1983).
#include "sdk/doctor/detail.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "sdk/doctor/decisions.hpp"
#include "sdk/io/statistics.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

using Decision = decisions::DoctorDetail;

// Energy in each block, gray levels squared, from the finest octave to coarser ones.
std::vector<cv::Mat> octaves_of(const cv::Mat& gray) {
    const cv::Size blocks(gray.cols / Decision::kBlock, gray.rows / Decision::kBlock);
    std::vector<cv::Mat> octaves(Decision::kOctaves);
    cv::Mat image;
    gray.convertTo(image, CV_32F);
    double rounding = Decision::kRounding;
    for (cv::Mat& energy : octaves) {
        cv::Mat half, coarse;
        cv::resize(image, half, image.size() / 2, 0, 0, cv::INTER_AREA);
        cv::resize(half, coarse, image.size(), 0, 0, cv::INTER_CUBIC);
        const cv::Mat detail = image - coarse;
        cv::resize(detail.mul(detail), energy, blocks, 0, 0, cv::INTER_AREA);
        energy = cv::max(energy - rounding, 0);
        image = half;
        rounding /= 4;
    }
    return octaves;
}

// Blocks that show neither highlight, text nor border, in them or beside them.
cv::Mat tissue_of(const cv::Mat& gray) {
    cv::Mat other, blocks;
    cv::inRange(gray, Decision::kBorder, Decision::kHighlight, other);
    other = 255 - other;
    cv::dilate(other, other,
               cv::getStructuringElement(cv::MORPH_RECT, {Decision::kAside, Decision::kAside}));
    other.convertTo(other, CV_32F);
    cv::resize(other, blocks, gray.size() / Decision::kBlock, 0, 0, cv::INTER_AREA);
    return blocks == 0;
}

}  // namespace

void DetailMeter::add(const cv::Mat& gray) {
    const cv::Rect whole(0, 0, gray.cols / Decision::kBlock * Decision::kBlock,
                         gray.rows / Decision::kBlock * Decision::kBlock);
    if (whole.empty()) return;
    const cv::Mat tissue = tissue_of(gray(whole));
    const std::vector<cv::Mat> octaves = octaves_of(gray(whole));
    for (int y = 0; y < tissue.rows; ++y)
        for (int x = 0; x < tissue.cols; ++x) {
            double all = 0;
            for (const cv::Mat& octave : octaves) all += octave.at<float>(y, x);
            if (tissue.at<std::uint8_t>(y, x) == 0 || all < Decision::kMinEnergy) continue;
            const double finest = octaves[0].at<float>(y, x);
            below_2_.push_back(finest / all);
            below_4_.push_back((finest + octaves[1].at<float>(y, x)) / all);
        }
}

double DetailMeter::finest_share() const { return nearest_rank(below_2_, 0.5); }

std::optional<int> DetailMeter::finest_px() const {
    if (below_2_.size() < Decision::kMinBlocks) return std::nullopt;
    if (finest_share() >= Decision::kMinBelow2) return 1;
    const double below_4 = nearest_rank(below_4_, 0.5);
    return below_4 >= Decision::kMinBelow4 ? 2 : 4;
}

DetailText detail_text(int finest_px) {
    const std::string share = finest_px == 2 ? "half" : "a quarter";
    return {
        "the images hold no detail finer than " + std::to_string(finest_px) +
            " px, as pictures that were magnified: less depth is found, fewer points are "
            "followed, and each frame takes longer",
        "Record without digital zoom, or in the size that the camera's sensor has; or resize the "
        "images to " +
            share +
            ", and multiply fx, cx, fy and cy of M1 and M2, image_width and "
            "image_height by " +
            format_fixed(1.0 / finest_px, 2) + "."};
}

}  // namespace defrec::cli
