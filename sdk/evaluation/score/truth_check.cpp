// Whether a truth is that of what was tracked.
#include "sdk/evaluation/score/truth_check.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "sdk/evaluation/score/percentile.hpp"
#include "sdk/io/counted.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {

namespace {

std::size_t count_lacking(const std::set<std::int64_t>& wanted,
                          const std::set<std::int64_t>& there) {
    return static_cast<std::size_t>(std::count_if(
        wanted.begin(), wanted.end(), [&](std::int64_t each) { return !there.contains(each); }));
}

}  // namespace

TruthCheck::TruthCheck(const TrackedPositions& tracked, std::string noun, Unfollowed unfollowed)
    : tracked_(tracked), noun_(std::move(noun)), unfollowed_(unfollowed) {
    first_frame_ = std::numeric_limits<std::int64_t>::max();
    for (const auto& [key, position] : tracked_) {
        tracked_ids_.insert(key.id);
        tracked_frames_.insert(key.frame);
        if (position) first_frame_ = std::min(first_frame_, key.frame);
    }
}

void TruthCheck::add(const FrameAndId& key, const Xyz& xyz, bool is_visible, bool is_scored) {
    true_frames_.insert(key.frame);
    if (is_scored) {
        true_ids_.insert(key.id);
        scored_frames_.insert(key.frame);
        if (!tracked_ids_.contains(key.id)) missing_ids_.insert(key.id);
        if (!tracked_frames_.contains(key.frame)) missing_frames_.insert(key.frame);
    }
    if (!is_visible || key.frame != first_frame_) return;
    const TrackedPosition* position = find(tracked_, key);
    if (position == nullptr || !position->expected_mm) return;
    ++compared_;
    const double error_mm = distance(position->xyz, xyz);
    if (error_mm > TruthLimits::kFarMm &&
        error_mm > TruthLimits::kFarExpected * *position->expected_mm)
        far_mm_.push_back(error_mm);
}

std::string TruthCheck::note_of_ids(const std::string& truth, const std::string& tracked) const {
    if (missing_ids_.size() == true_ids_.size()) {
        return "no id of " + truth + " is in " + tracked + ": is it the truth of other " + noun_ +
               "s?";
    }
    if (!missing_ids_.empty()) {
        return tracked + " lacks " + std::to_string(missing_ids_.size()) + " of the " +
               counted(true_ids_.size(), noun_) + " of " + truth + " (the first is id " +
               std::to_string(*missing_ids_.begin()) + "), which " +
               (unfollowed_ == Unfollowed::kLost ? "count as lost." : "are not measured.");
    }
    const std::size_t lacking = count_lacking(tracked_ids_, true_ids_);
    if (lacking == 0) return {};
    return truth + " lacks " + std::to_string(lacking) + " of the " +
           counted(tracked_ids_.size(), noun_) + " of " + tracked + ", which are not measured.";
}

std::string TruthCheck::note_of_frames(const std::string& truth, const std::string& tracked) const {
    if (missing_frames_.size() == scored_frames_.size())
        return "no frame of " + truth + " is in " + tracked + ".";
    if (!missing_frames_.empty()) {
        return tracked + " lacks " + std::to_string(missing_frames_.size()) + " of the " +
               counted(scored_frames_.size(), "frame") + " of " + truth + " (the first is " +
               std::to_string(*missing_frames_.begin()) + "), whose " + noun_ +
               "s count as lost. --frames A:B leaves them out.";
    }
    const std::size_t lacking = count_lacking(tracked_frames_, true_frames_);
    if (lacking == 0) return {};
    return truth + " lacks " + std::to_string(lacking) + " of the " +
           counted(tracked_frames_.size(), "frame") + " of " + tracked +
           ", which are not measured: is it the truth of another sequence?";
}

std::string TruthCheck::note_of_places(const std::string& truth) const {
    const std::size_t far = far_mm_.size();
    if (far < std::min(compared_, TruthLimits::kMinFar) || far == 0 ||
        static_cast<double>(far) <= TruthLimits::kMaxFarShare * static_cast<double>(compared_))
        return {};
    std::vector<double> ascending = far_mm_;
    std::sort(ascending.begin(), ascending.end());
    return "in frame " + std::to_string(first_frame_) + ", the first with positions, " +
           std::to_string(far) + " of " + counted(compared_, noun_) + (far == 1 ? " is" : " are") +
           " more than " + format_fixed(TruthLimits::kFarExpected, 0) +
           " expected errors away from the truth, " + (far == 1 ? "by " : "half of these by ") +
           format_fixed(percentile(ascending, 0.5), 1) + " mm or more: is " + truth +
           " the truth of another sequence, of other " + noun_ +
           "s, or in another unit? If not, the calibration may be of other cameras.";
}

TruthDoubt TruthCheck::doubt(const std::string& truth, const std::string& tracked) const {
    if (tracked_ids_.empty()) return {};
    if (missing_ids_.size() == true_ids_.size()) return {note_of_ids(truth, tracked), true};
    if (missing_frames_.size() == scored_frames_.size())
        return {note_of_frames(truth, tracked), true};
    return {note_of_places(truth), false};
}

std::vector<std::string> TruthCheck::notes(const std::string& truth,
                                           const std::string& tracked) const {
    std::vector<std::string> notes;
    for (std::string note :
         {note_of_ids(truth, tracked), note_of_frames(truth, tracked), note_of_places(truth)})
        if (!note.empty()) notes.push_back(std::move(note));
    return notes;
}

}  // namespace defrec::cli
