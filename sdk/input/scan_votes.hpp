// Whether a video is interlaced, by what its images say two by two.
#pragma once

#include <opencv2/core.hpp>

#include "sdk/io/field_order.hpp"

namespace defrec::cli {

class ScanVotes {
  public:
    // So many pairs of images must say that the video is interlaced.
    explicit ScanVotes(int enough) : enough_(enough) {}

    // The next image of one view. Its pixels stay as they are until another one was added.
    void add(const cv::Mat& image);
    // Further images cannot change it.
    bool is_settled() const;
    FieldOrder order() const;

  private:
    const int enough_;
    cv::Mat last_;
    int progressive_ = 0, top_first_ = 0, bottom_first_ = 0;
};

}  // namespace defrec::cli
