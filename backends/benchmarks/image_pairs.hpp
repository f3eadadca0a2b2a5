// Pairs of images with the truth of where each pixel of the first went, for the benchmarks of orb.
// Needs OpenCV to read files.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace defrec::benchmarks {

struct GrayImage {
    uint32_t width = 0, height = 0;
    std::vector<uint8_t> pixels;  // without padding
};

struct Point {
    double x, y;  // px
};

// Where a pixel of the first image is in the second: by a homography, or between points whose true
// places are known.
class Flow {
  public:
    static Flow homography(const double (&row_major)[9]);
    // Points that are visible in both images.
    static Flow between(std::vector<Point> from, std::vector<Point> to);
    // Nothing where it is not known. Between points it is the affine map that fits the six nearest,
    // near ones more, and is good to about half a pixel.
    std::optional<Point> operator()(Point pixel) const;

  private:
    std::vector<double> homography_;
    std::vector<Point> from_, to_;
    double reach_ = 0;  // px; farther from the third nearest point nothing is known
};

struct ImagePair {
    std::string set;  // the data set's name
    GrayImage first, second;
    std::optional<Flow> flow;
};

// Left images 0 and k, for each k of frames that the folder has: left/*.png, calibration.yaml,
// points.csv, truth.csv as `defrec render` writes them. Empty when the folder is not there. Throws
// std::runtime_error when truth and points disagree.
std::vector<ImagePair> load_scene(const std::string& folder, const std::string& name,
                                  const std::vector<size_t>& frames);

// Two images with a homography from the first to the second (an OpenCV file with H13), or without
// truth where that is "".
std::vector<ImagePair> load_pair(const std::string& first, const std::string& second,
                                 const std::string& homography, const std::string& name);

}  // namespace defrec::benchmarks
