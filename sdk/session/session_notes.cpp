// See session_notes.hpp.
#include "sdk/session/session_notes.hpp"

#include <algorithm>
#include <iterator>

#include "include/defrec_c.h"
#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/detail.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/one_view_twice.hpp"
#include "sdk/input/compression/decisions.hpp"
#include "sdk/input/view_image.hpp"
#include "sdk/io/interrupt.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

struct ReasonNote {
    std::uint32_t reason;
    const char* text;
    NoteSeverity severity;
};
constexpr ReasonNote kReasonNotes[] = {
    {DEFREC_REASON_INTERLACED,
     "In some frames the rows of an image are of two times, as those of interlaced video; if all "
     "images are so, give --interlaced top-first or --interlaced bottom-first.",
     NoteSeverity::kWarning},
    {DEFREC_REASON_DISPARITY,
     "In some frames the images contradict the disparity of --disparity, whose depth was not used "
     "there. Its files must be of these frames, and in px of the rectified left image: x in the "
     "left image less x in the right one. See as well whether --disparity-sigma is too small.",
     NoteSeverity::kError},
};

// Its view_lag_frames is 0: no clock has to be set.
bool is_one_view_still(const defrec_result& result) {
    return (result.reasons & DEFREC_REASON_VIEW_LATE) != 0 &&
           (result.reasons & DEFREC_REASON_FROZEN) == 0 &&
           (result.faulty_views == DEFREC_VIEW_LEFT || result.faulty_views == DEFREC_VIEW_RIGHT);
}

std::string still_view_note(std::uint32_t views) {
    if (views == 0) return {};
    const char* which = views == DEFREC_VIEW_LEFT    ? "the left picture"
                        : views == DEFREC_VIEW_RIGHT ? "the right picture"
                                                     : "one of the two pictures";
    return std::string("In some frames ") + which +
           " stands still while the other one moves; check that video input. See faulty_views in "
           "frames.csv.";
}

// In the middle of the left image, so that it takes no longer than a small frame.
std::optional<int> finest_detail(const StereoFrame& frame) {
    const cv::Mat left = mat_of(frame.left);
    const int width = std::min(left.cols, decisions::DoctorDetail::kMiddle),
              height = std::min(left.rows, decisions::DoctorDetail::kMiddle);
    const cv::Mat middle =
        left(cv::Rect((left.cols - width) / 2, (left.rows - height) / 2, width, height));
    DetailMeter meter;
    meter.add(gray_of(
        {middle.data, width, height, frame.left.channels, static_cast<std::size_t>(middle.step)}));
    return meter.finest_px();
}

std::string one_view_note(const StereoFrame& frame) {
    if (difference_of_views({gray_of(frame.left), gray_of(frame.right)}) >=
        decisions::DoctorViews::kSameView)
        return {};
    std::string note = std::string(kOneViewTwice) + " " + kOneViewRemedy;
    note.front() = 'L';
    return note;
}

std::string detail_note(int finest_px) {
    DetailText text = detail_text(finest_px);
    text.what.front() = 'T';
    return text.what + ". " + text.remedy;
}

}  // namespace

void SessionNotes::add_fields(FieldOrder fields) {
    if (!is_interlaced(fields)) return;
    add(std::string("The images are interlaced, ") +
            (fields == FieldOrder::kTopFirst ? "top" : "bottom") +
            " field first; each field was tracked as a frame, two for each image.",
        NoteSeverity::kRemark);
}

void SessionNotes::add_source(const SourceOptions& source) {
    if (!source.stereo.empty() || source.bag.has_stereo_images)
        swapped_note_ =
            std::string("The two halves of the images look swapped. ") + kHalvesExchanged;
    else if (source.bag.is_given())
        swapped_note_ = "The two images look swapped; exchange --left-topic and --right-topic.";
}

std::string SessionNotes::add_frame(const StereoFrame& frame, const defrec_result& result) {
    lag_.add(result, is_one_view_still(result));
    if (is_one_view_still(result)) {
        still_views_ |= result.faulty_views;
        reasons_ |= result.reasons & ~std::uint32_t{DEFREC_REASON_VIEW_LATE};
    } else {
        reasons_ |= result.reasons;
    }
    if ((result.reasons & DEFREC_REASON_CALIBRATION) != 0) drift_.add(frame, result);
    start_errors_.add(frame.index, result);
    NoteSeverity severity = NoteSeverity::kWarning;
    std::string note = compression_.add(frame, result);
    // The first frames may be black.
    if (!finest_px_ && looked_at_ < decisions::CompressedVideo::kFrames && note.empty()) {
        ++looked_at_;
        finest_px_ = finest_detail(frame);
        if (finest_px_) {
            note = one_view_note(frame);
            is_one_view_twice_ = !note.empty();
            if (is_one_view_twice_) severity = NoteSeverity::kError;
        }
        if (note.empty() && finest_px_.value_or(1) > 1) note = detail_note(*finest_px_);
    }
    if (note.empty()) return note;
    said_.push_back(note);
    add(note, severity);
    return note;
}

std::vector<std::string> SessionNotes::left_to_say() const {
    std::vector<std::string> left;
    std::copy_if(notes_.begin(), notes_.end(), std::back_inserter(left),
                 [this](const std::string& note) {
                     return std::find(said_.begin(), said_.end(), note) == said_.end();
                 });
    return left;
}

void SessionNotes::add_frame_of_points(std::int64_t first, bool any) {
    if (any && first > 0)
        add("Points to follow without a frame were taken to be pixels of frame " +
                std::to_string(first) + ", the first of --frames.",
            NoteSeverity::kRemark);
}

void SessionNotes::add_late_template(const LateTemplate& late) {
    const std::string number = std::to_string(late.frame);
    std::string text =
        late.was_asked_for
            ? "The template was taken from frame " + number
            : "The first frame could not give a good template; it was taken from frame " + number;
    if (late.is_followed_back) text += ", and all frames were followed from it";
    add(text + ".", NoteSeverity::kRemark);
    if (late.has_targets)
        add("The targets were taken to be given in the left rectified camera of frame " + number +
            ", the template's.");
}

void SessionNotes::add_given_up(std::int64_t template_frame, std::int64_t frame) {
    add("The template of frame " + std::to_string(template_frame) + " was given up in frame " +
            std::to_string(frame) +
            ", since good frames did not show it; points and targets given before are lost from "
            "there on.",
        NoteSeverity::kError);
}

void SessionNotes::add_points(const PointFollower& points) {
    const bool is_half_lost =
        2 * points.rows().share(PointStatus::kLost) > 1 && points.rows().any_position();
    if (is_half_lost)
        add("The points are lost in " +
                format_fixed(100 * points.rows().share(PointStatus::kLost), 0) +
                " % of their rows: what is said of the surface is not true of them.",
            NoteSeverity::kError);
    const std::string all = " of " + std::to_string(points.count()) + " points to follow ";
    if (const auto& ids = points.points_without_surface(); !ids.empty())
        add(std::to_string(ids.size()) + all + "lie where the template has no surface (" +
            first_ids(ids) + "); they are lost in every frame.");
    if (const std::size_t count = points.points_of_lost_frames(); count > 0)
        add(std::to_string(count) + all +
            "were given in a frame in which the surface was not followed, or not closely; they "
            "are lost in every frame. Give pixels of a frame N that shows the tissue: with "
            "--frames N:, or with N in a column frame of the points file.");
    if (const std::size_t count = points.points_never_reached(); count > 0)
        add(std::to_string(count) + all +
            "are of frames that the run did not reach; they have one row each, and are lost.");
}

void SessionNotes::add_targets(const TargetPlacesNote& places, const char* name, bool is_any_placed,
                               bool has_tracked) {
    add(places.text, places.is_most ? NoteSeverity::kError : NoteSeverity::kWarning);
    if (has_tracked && !places.is_most && !is_any_placed)
        add("The " + std::string(name) +
                " are lost in every frame, though the surface is followed: they lie too far from "
                "what is seen of it.",
            NoteSeverity::kError);
}

void SessionNotes::add_untracked(const Ending& ending) {
    if (!ending.unfound_template.empty())
        add("The template of " + ending.unfound_template +
                " was found in no frame: it may be of other tissue, of another recording, or of "
                "another calibration.",
            NoteSeverity::kError);
    if (!ending.has_tracked)
        add(ending.has_template ? kNothingTracked
                                : "No frame could give a template; nothing was tracked. defrec "
                                  "doctor, with the same images and calibration, looks for the "
                                  "cause.",
            NoteSeverity::kError);
}

void SessionNotes::add_rig() {
    if ((reasons_ & DEFREC_REASON_VIEWS_SWAPPED) != 0) add(swapped_note_, NoteSeverity::kError);
    const bool is_late = lag_.is_lasting(drift_.frames());
    add(lag_.note(drift_.frames()),
        is_late && lag_.is_in_most() ? NoteSeverity::kError : NoteSeverity::kWarning);
    if (is_late) return;
    const bool is_mild = drift_.is_mild() || lag_.frames() < decisions::DoctorSample::kMinFrames;
    add(drift_.note(lag_.frames(), may_correct_),
        is_mild ? NoteSeverity::kWarning : NoteSeverity::kError);
}

void SessionNotes::conclude(const PointFollower& points, const TargetFollower* targets,
                            const PlanFollower* plan, const Ending& ending) {
    add(compression_.conclude());
    add_points(points);
    if (targets != nullptr)
        add_targets(targets->places(), "targets", targets->rows().any_position(),
                    ending.has_tracked);
    if (plan != nullptr && plan->target_count() > 0)
        add_targets(plan->places(), "targets of the plan", plan->target_rows().any_position(),
                    ending.has_tracked);
    add_untracked(ending);
    for (const auto& [reason, text, severity] : kReasonNotes)
        if ((reasons_ & reason) != 0) add(text, severity);
    add_rig();
    add(still_view_note(still_views_));
    if (interrupt_requested()) add("Interrupted; the outputs hold the frames tracked until then.");
    // For files alone: what is printed at the end has no expected errors.
    if (const std::string note = start_errors_.note(); !note.empty()) {
        said_.push_back(note);
        add(note, NoteSeverity::kRemark);
    }
}

}  // namespace defrec::cli
