// Whether a truth is that of what was tracked.
#include "sdk/evaluation/score/truth_check.hpp"

#include <algorithm>
#include <cmath>
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

// "0 to 25".
std::string frames_of(const std::set<std::int64_t>& frames) {
    if (frames.empty()) return "none";
    const std::string first = std::to_string(*frames.begin());
    return frames.size() == 1 ? first : first + " to " + std::to_string(*frames.rbegin());
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

bool TruthCheck::add(const FrameAndId& key, const Xyz& xyz, bool is_visible, bool is_scored) {
    if (!rows_.insert(key).second) return false;
    true_frames_.insert(key.frame);
    if (is_visible) true_places_.emplace(key, xyz);
    if (is_scored) {
        true_ids_.insert(key.id);
        scored_frames_.insert(key.frame);
        if (!tracked_ids_.contains(key.id)) missing_ids_.insert(key.id);
        if (!tracked_frames_.contains(key.frame)) missing_frames_.insert(key.frame);
    }
    if (!is_visible || key.frame != first_frame_) return true;
    const TrackedPosition* position = find(tracked_, key);
    if (position == nullptr || !position->expected_mm) return true;
    ++compared_;
    const double error_mm = distance(position->xyz, xyz);
    if (error_mm > TruthLimits::kFarMm &&
        error_mm > TruthLimits::kFarExpected * *position->expected_mm) {
        far_mm_.push_back(error_mm);
        scales_.push_back(distance(xyz, {}) / distance(position->xyz, {}));
    }
    return true;
}

std::string TruthCheck::no_row_of(const std::string& truth, const FrameRange& range) const {
    if (true_frames_.empty()) return truth + ": the truth holds no row.";
    const std::string asked =
        range.last ? std::to_string(range.first) + " to " + std::to_string(*range.last - 1)
                   : std::to_string(range.first) + " and later";
    return truth + ": the truth has no row of frames " + asked +
           ", which --frames asks for; its frames are " + frames_of(true_frames_) + ".";
}

std::string TruthCheck::note_of_other_ids(const std::string& truth,
                                          const std::string& tracked) const {
    return "no id of " + truth + " is in " + tracked + ": is it the truth of other " + noun_ + "s?";
}

std::string TruthCheck::note_of_other_frames(const std::string& truth,
                                             const std::string& tracked) const {
    std::string note = "no frame of " + truth + " (" + frames_of(scored_frames_) + ") is in " +
                       tracked + " (" + frames_of(tracked_frames_) + ").";
    if (shift_) note.append(" ").append(sentence_of(*shift_, truth, noun_));
    return note;
}

std::vector<std::string> TruthCheck::notes_of_ids(const std::string& truth,
                                                  const std::string& tracked) const {
    if (has_other_ids()) return {note_of_other_ids(truth, tracked)};
    std::vector<std::string> notes;
    if (!missing_ids_.empty()) {
        notes.push_back(
            tracked + " lacks " + std::to_string(missing_ids_.size()) + " of the " +
            counted(true_ids_.size(), noun_) + " of " + truth + " (the first is id " +
            std::to_string(*missing_ids_.begin()) + "), which " +
            (unfollowed_ == Unfollowed::kLost ? "count as lost." : "are not measured."));
    }
    if (const std::size_t lacking = count_lacking(tracked_ids_, true_ids_); lacking > 0) {
        notes.push_back(truth + " lacks " + std::to_string(lacking) + " of the " +
                        counted(tracked_ids_.size(), noun_) + " of " + tracked +
                        ", which are not measured.");
    }
    return notes;
}

std::vector<std::string> TruthCheck::notes_of_frames(const std::string& truth,
                                                     const std::string& tracked) const {
    if (has_other_frames()) return {note_of_other_frames(truth, tracked)};
    std::vector<std::string> notes;
    if (!missing_frames_.empty()) {
        notes.push_back(tracked + " lacks " + std::to_string(missing_frames_.size()) + " of the " +
                        counted(scored_frames_.size(), "frame") + " of " + truth +
                        " (the first is " + std::to_string(*missing_frames_.begin()) + "), whose " +
                        noun_ + "s count as lost. --frames A:B leaves them out.");
    }
    if (const std::size_t lacking = count_lacking(tracked_frames_, true_frames_); lacking > 0) {
        notes.push_back(truth + " lacks " + std::to_string(lacking) + " of the " +
                        counted(tracked_frames_.size(), "frame") + " of " + tracked +
                        ", which are not measured: is it the truth of another sequence?");
    }
    return notes;
}

std::string TruthCheck::question_of_places(const std::string& truth) const {
    struct Unit {
        const char* name;
        double per_mm;
    };
    constexpr Unit kUnits[] = {{"metres", 0.001}, {"centimetres", 0.1}, {"micrometres", 1000}};
    constexpr double kUnlike = 0.2;
    std::vector<double> ascending = scales_;
    std::sort(ascending.begin(), ascending.end());
    for (const auto& [name, per_mm] : kUnits)
        if (std::abs(percentile(ascending, 0.5) / per_mm - 1) < kUnlike)
            return truth + " seems to be in " + name + ", and mm are expected.";
    return "is " + truth + " the truth of another sequence, of other " + noun_ +
           "s, or in another unit? If not, the calibration may be of other cameras.";
}

std::string TruthCheck::note_of_places(const std::string& truth) const {
    if (shift_) return sentence_of(*shift_, truth, noun_);
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
           format_fixed(percentile(ascending, 0.5), 1) +
           " mm or more: " + question_of_places(truth);
}

TruthDoubt TruthCheck::doubt(const std::string& truth, const std::string& tracked) const {
    if (tracked_ids_.empty()) return {};
    if (has_other_ids()) return {note_of_other_ids(truth, tracked), true};
    if (has_other_frames()) return {note_of_other_frames(truth, tracked), true};
    return {note_of_places(truth), false};
}

std::vector<std::string> TruthCheck::notes(const std::string& truth,
                                           const std::string& tracked) const {
    std::vector<std::string> notes = notes_of_ids(truth, tracked);
    for (std::string& note : notes_of_frames(truth, tracked)) notes.push_back(std::move(note));
    // Where no frame is common, its note has the shift.
    if (std::string note = note_of_places(truth); !note.empty() && !has_other_frames())
        notes.push_back(std::move(note));
    return notes;
}

}  // namespace defrec::cli
