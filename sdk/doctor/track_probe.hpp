// What a tracker says of frames.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "sdk/doctor/evidence.hpp"

namespace defrec::cli {

struct ProbeOptions {
    std::string backend = "auto", device;
    unsigned threads = 0;
    std::string config;  // empty: the library's defaults
};

// Gathers the results of frames, one after the other.
class ProbeRecord {
  public:
    // The tracker keeps disparities; its images have this size.
    void add(const defrec_result& result, int width, int height);
    const TrackedFrame& last() const { return frames_.back(); }
    // All that was added, together. camera: of the rectified views.
    TrackProbe probe(bool has_rig, const defrec_camera& camera) const;

  private:
    // The disparity, px, below or at which so many of those that were counted lie.
    double disparity_at(std::size_t rank) const;

    std::vector<TrackedFrame> frames_;
    std::array<std::size_t, 1 + INT16_MAX / DEFREC_DISPARITY_ONE> disparities_{};  // by whole px
    std::size_t counted_ = 0;
};

// Gives the frames to a tracker. calibration: what the library takes; nullptr: a nominal one takes
// its place, with which only the images say something. `refusal`: on return why the library refuses
// it, where it does.
TrackProbe track_frames(const ProbeOptions& options, const std::vector<StereoFrame>& frames,
                        const StereoCalibration* calibration, std::string& refusal);

}  // namespace defrec::cli
