// See pose_matching.hpp.
#include "sdk/hand_eye/pose_matching.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/base/util/error.hpp"
#include "sdk/hand_eye/decisions.hpp"
#include "sdk/hand_eye/time_offset.hpp"

namespace defrec {
namespace {

using decisions::HandEyeOffset;
using decisions::HandEyePoses;

}  // namespace

std::string PoseMatching::match() {
    if (options_.is_paired) {
        match_all();
    } else if (std::string reason = match_streams(); !reason.empty()) {
        return reason;
    }
    if (pairs_.size() >= HandEyePoses::kMinPoses) return {};
    return concat("there are ", pairs_.size(), " poses of both at one time, expected ",
                  HandEyePoses::kMinPoses, " at least");
}

void PoseMatching::match_all() {
    if (camera_.size() != tracker_.size())
        fail(DEFREC_ERROR_ARGUMENT, "hand-eye poses in pairs: ", camera_.size(),
             " poses of the camera and ", tracker_.size(),
             " of the tracker were given, expected as many");
    check_poses(camera_, "camera's poses");
    check_poses(tracker_, "tracker's poses");
    for (std::size_t i = 0; i < camera_.size(); ++i) {
        used_.push_back(i);
        pairs_.push_back({camera_[i].pose, tracker_[i].pose});
    }
}

std::string PoseMatching::match_streams() {
    const PoseStream camera(camera_, "camera's poses");
    stream_.emplace(tracker_, "tracker's poses");
    const double away = options_.offset_s ? 0 : options_.max_offset_s,
                 shift = options_.offset_s.value_or(0);
    if (camera.end() + shift + away < stream_->begin() ||
        camera.begin() + shift - away > stream_->end())
        return concat("the streams do not overlap: the camera's poses are from ", camera.begin(),
                      " to ", camera.end(), " s, the tracker's from ", stream_->begin(), " to ",
                      stream_->end(), " s, and the offset is ", options_.offset_s ? "" : "at most ",
                      shift + away, " s. Use one clock for both");
    if (options_.offset_s) {
        offset_ = shift;
    } else {
        const OffsetSearch found = find_offset(camera, *stream_, options_.max_offset_s);
        correlation_ = found.correlation;
        if (!found.is_found)
            return "the offset between both clocks does not show: " + found.reason +
                   ". Turn the camera faster and slower, or state the offset";
        first_offset_ = offset_ = found.offset_s;
    }
    choose_poses();
    pair_up();
    return {};
}

// Poses of the camera for which there is one of the marker, at any offset near the one found.
void PoseMatching::choose_poses() {
    const double margin = span() + HandEyeOffset::kWindow;
    std::vector<std::size_t> all;
    for (std::size_t i = 0; i < camera_.size(); ++i) {
        const double time = camera_[i].time_s + offset_;
        if (stream_->at(time) &&
            (!has_offset() || (stream_->at(time - margin) && stream_->at(time + margin))))
            all.push_back(i);
    }
    const std::size_t count = std::min(all.size(), HandEyePoses::kMaxPoses);
    for (std::size_t i = 0; i < count; ++i) used_.push_back(all[i * all.size() / count]);
}

// Half the time over which a marker's speed is measured: its ends are other poses than those
// between which a pose is interpolated, so that their errors are independent.
double PoseMatching::span() const {
    return std::max(HandEyeOffset::kSpan, 2 * stream_->interval());
}

void PoseMatching::pair_up() {
    pairs_.clear();
    double averaged = 0;
    std::vector<std::size_t> used;
    for (const std::size_t i : used_) {
        const double time = camera_[i].time_s + offset_;
        const auto now = stream_->at(time), before = stream_->at(time - span()),
                   after = stream_->at(time + span());
        const bool has_speed = before && after;
        if (!now || (!has_speed && has_offset())) continue;
        HandEyePair pair{camera_[i].pose, now->pose};
        if (has_speed) {
            pair.turn_rate =
                turn_of(before->pose.linear().transpose() * after->pose.linear()) / (2 * span());
            pair.velocity = (after->pose.translation() - before->pose.translation()) / (2 * span());
        }
        averaged += now->share * now->share + (1 - now->share) * (1 - now->share);
        pairs_.push_back(pair);
        used.push_back(i);
    }
    used_ = used;
    if (!pairs_.empty()) averaged_ = averaged / static_cast<double>(pairs_.size());
}

void PoseMatching::change_offset(double change_s) {
    const double most = HandEyeOffset::kWindow;
    offset_ = std::clamp(offset_ + change_s, first_offset_ - most, first_offset_ + most);
    pair_up();
}

HandEyeNoise PoseMatching::noise_of_pairs(HandEyeNoise noise) const {
    noise.tracker_mm *= std::sqrt(averaged_);
    noise.tracker_rad *= std::sqrt(averaged_);
    return noise;
}

}  // namespace defrec
