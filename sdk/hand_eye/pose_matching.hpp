// Which pose of the camera belongs to which of its marker: by their order, or by their times.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "sdk/hand_eye/hand_eye.hpp"

namespace defrec {

class PoseMatching {
  public:
    // Borrows all three.
    PoseMatching(const std::vector<TimedPose>& camera, const std::vector<TimedPose>& tracker,
                 const HandEyeOptions& options)
        : camera_(camera), tracker_(tracker), options_(options) {}

    // Returns why there are no pairs, empty where there are. Throws Error for poses that are none.
    std::string match();
    // Pairs streams by another offset, which stays near the one that was found first.
    void change_offset(double change_s);

    const HandEyePairs& pairs() const { return pairs_; }
    const std::vector<std::size_t>& used() const { return used_; }  // the camera's pose of each
    bool has_offset() const { return !options_.is_paired && !options_.offset_s; }
    double offset_s() const { return offset_; }
    double correlation() const { return correlation_; }
    // Interpolated poses of the marker have a part of the variance of those between which they lie.
    HandEyeNoise noise_of_pairs(HandEyeNoise noise) const;

  private:
    void match_all();
    std::string match_streams();
    void choose_poses();
    double span() const;
    void pair_up();

    const std::vector<TimedPose>&camera_, &tracker_;
    const HandEyeOptions& options_;
    std::optional<PoseStream> stream_;  // the tracker's
    double first_offset_ = 0, offset_ = 0, correlation_ = 0;
    double averaged_ = 1;  // variance of an interpolated pose, in that of a pose
    std::vector<std::size_t> used_;
    HandEyePairs pairs_;
};

}  // namespace defrec
