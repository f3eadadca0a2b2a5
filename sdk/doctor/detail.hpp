// How fine the detail of an image is: of one that was magnified, or is out of focus or smoothed,
// the pixels are smaller than what it shows.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

namespace defrec::cli {

// Gathers images of one recording.
class DetailMeter {
  public:
    // Gray, 8 bit.
    void add(const cv::Mat& gray);
    // The images hold no detail finer than so many px: 4 or 2, or 1, which is as fine as pixels can
    // show; empty: too little texture tells.
    std::optional<int> finest_px() const;
    // The median share of the energy of blocks with texture that is finer than 2 px; 0: no block.
    double finest_share() const;

  private:
    // For each block the share of its energy that is finer than 2 and than 4 px.
    std::vector<double> below_2_, below_4_;
};

// "the images hold no detail finer than 4 px", and what to do.
struct DetailText {
    std::string what, remedy;
};
DetailText detail_text(int finest_px);

}  // namespace defrec::cli
