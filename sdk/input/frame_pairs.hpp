// Pairs of images of two cameras, formed by their times. Only the newest pair is kept: a tracker
// that is slower than its cameras misses frames instead of falling behind.
#pragma once

#include <array>
#include <cstddef>
#include <deque>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>

#include "sdk/input/camera_counts.hpp"

namespace defrec::cli {

struct CameraImage {
    cv::Mat image;                       // 8 bits, gray or BGR; shows `memory`
    double time_ms = 0;                  // of the source
    std::shared_ptr<const void> memory;  // null where the image owns its pixels
};

struct CameraPair {
    CameraImage left, right;
};

// One thread at a time.
class FramePairs {
  public:
    enum class View { kLeft, kRight };

    // So many images of one view wait for their partners: by default, by how many frames cameras of
    // a pair are apart in their delivery.
    explicit FramePairs(std::size_t most_waiting = 4) : most_waiting_(most_waiting) {}

    // The times within a pair differ by at most that much: half of the time between frames.
    void set_tolerance(double milliseconds) { tolerance_ms_ = milliseconds; }
    void add(View view, CameraImage image);
    // Adds a pair of a source that carries both views.
    void add_pair(CameraPair pair);
    // The newest pair, once.
    std::optional<CameraPair> take();
    // No image comes any more: those that wait have no partner.
    void end();
    // Forgets what waits, not the counts.
    void clear();
    const PairCounts& counts() const { return counts_; }

  private:
    const std::size_t most_waiting_;
    double tolerance_ms_ = 0;
    std::array<std::deque<CameraImage>, 2> waiting_;  // in the order in which they came
    std::optional<CameraPair> newest_;
    PairCounts counts_;
};

}  // namespace defrec::cli
