// See evidence.hpp.
#include "sdk/doctor/evidence.hpp"

#include <algorithm>
#include <utility>

#include "sdk/doctor/decisions.hpp"
#include "sdk/input/view_image.hpp"

namespace defrec::cli {
namespace {

CompressionSigns signs_of_compression(const std::vector<StereoFrame>& frames) {
    CompressionMeter meter;
    for (const StereoFrame& frame : frames) {
        if (meter.is_complete()) break;
        meter.add(gray_of(frame.left), gray_of(frame.right));
    }
    return meter.signs();
}

BlankFrame::Look look_of(const ImageView& view) {
    using Decision = decisions::DoctorImages;
    const cv::Mat gray = gray_of(view);
    if (cv::mean(gray)[0] < Decision::kBlack) return BlankFrame::kBlack;
    const int saturated = cv::countNonZero(gray >= Decision::kSaturated);
    return saturated > Decision::kWhite * static_cast<double>(gray.total()) ? BlankFrame::kWhite
                                                                            : BlankFrame::kLit;
}

FieldOrder fields_of(const StereoFrame& frame) {
    if (frame.field == DEFREC_FIELD_NONE) return FieldOrder::kProgressive;
    const bool is_bottom = frame.field == DEFREC_FIELD_BOTTOM;
    return is_bottom_field(FieldOrder::kTopFirst, frame.index) == is_bottom
               ? FieldOrder::kTopFirst
               : FieldOrder::kBottomFirst;
}

// A calibration for images of another size, where they are the same picture.
StereoCalibration scaled(const StereoCalibration& calibration, int width, int height) {
    StereoCalibration made = calibration;
    const double x = static_cast<double>(width) / calibration.width,
                 y = static_cast<double>(height) / calibration.height;
    for (CameraCalibration* camera : {&made.left, &made.right}) {
        camera->fx *= x;
        camera->fy *= y;
        camera->cx = (camera->cx + 0.5) * x - 0.5;
        camera->cy = (camera->cy + 0.5) * y - 0.5;
    }
    return made;
}

}  // namespace

bool TrackedFrame::is_lit() const {
    return (reasons & (DEFREC_REASON_DARK | DEFREC_REASON_SATURATED)) == 0;
}

std::size_t TrackProbe::frames_with(std::uint32_t reasons) const {
    return static_cast<std::size_t>(
        std::count_if(frames.begin(), frames.end(),
                      [&](const TrackedFrame& frame) { return (frame.reasons & reasons) != 0; }));
}

std::size_t TrackProbe::lit_frames_with(std::uint32_t reasons) const {
    return static_cast<std::size_t>(
        std::count_if(frames.begin(), frames.end(), [&](const TrackedFrame& frame) {
            return frame.is_lit() && (frame.reasons & reasons) != 0;
        }));
}

double TrackProbe::share_without_depth() const {
    double sum = 0;
    std::size_t count = 0;
    for (const TrackedFrame& frame : frames) {
        if (!frame.is_lit()) continue;
        sum += 1 - frame.depth_share;
        ++count;
    }
    return sum / static_cast<double>(std::max<std::size_t>(count, 1));
}

const RigTrial& Evidence::without(Mistake mistake) const {
    return *std::find_if(trials.begin(), trials.end(),
                         [&](const RigTrial& trial) { return trial.mistake == mistake; });
}

bool Evidence::are_most(std::size_t frames) const {
    return static_cast<double>(frames) >
           decisions::DoctorImages::kMostBlank * static_cast<double>(frame_count);
}

bool Evidence::has_depth() const {
    return has_trials() && as_given().front_share >= decisions::DoctorOrder::kMinFront;
}

StereoCalibration fitting_calibration(const Evidence& evidence) {
    return evidence.has_other_size ? scaled(evidence.calibration, evidence.width, evidence.height)
                                   : evidence.calibration;
}

std::size_t frames_to_look_at(int width, int height) {
    using Decision = decisions::DoctorSample;
    const double pixels = static_cast<double>(width) * height;
    return static_cast<std::size_t>(
        std::clamp(static_cast<std::int64_t>(Decision::kTrackedPixels / pixels),
                   Decision::kMinFrames, Decision::kMaxFrames));
}

FramesToMatch::FramesToMatch(std::size_t count, std::size_t most) : count_(count) {
    const std::size_t matched = std::min(count, most);
    for (std::size_t i = 0; i < matched; ++i)
        planned_.push_back(matched > 1 ? i * (count - 1) / (matched - 1) : 0);
}

bool FramesToMatch::takes(bool is_blank) {
    const std::size_t frame = next_++;
    const bool is_due = taken_ < planned_.size() && planned_[taken_] <= frame;
    const bool is_last_chance = taken_ == 0 && next_ == count_;
    if (is_last_chance || (is_due && !is_blank)) {
        ++taken_;
        return true;
    }
    return false;
}

Evidence begin_evidence(const StereoFrame& first) {
    Evidence evidence;
    evidence.width = first.left.width;
    evidence.height = first.left.height;
    evidence.fields = fields_of(first);
    evidence.first_frame = first.index;
    return evidence;
}

BlankFrame look_of(const StereoFrame& frame) {
    return {frame.index, look_of(frame.left), look_of(frame.right)};
}

GrayPair gray_views(const StereoFrame& frame) {
    const auto gray = [](const ImageView& view) {
        return view.channels == 1 ? mat_of(view).clone() : gray_of(view);
    };
    return {gray(frame.left), gray(frame.right)};
}

void add_views(GrayPair views, Evidence& evidence) {
    for (ViewMatch match : match_views(views.left, views.right)) {
        match.pair = static_cast<int>(evidence.pairs.size());
        evidence.matches.push_back(match);
    }
    evidence.pairs.push_back(std::move(views));
}

void add_calibration(StereoCalibration calibration, std::string refusal, Evidence& evidence) {
    evidence.refusal = std::move(refusal);
    evidence.has_other_size = calibration.width > 0 && (calibration.width != evidence.width ||
                                                        calibration.height != evidence.height);
    evidence.calibration = std::move(calibration);
    if (evidence.matches.size() < decisions::DoctorMatches::kMinMatches ||
        !has_pose(evidence.calibration))
        return;
    const StereoCalibration fitting = fitting_calibration(evidence);
    for (const Mistake mistake :
         {Mistake::kNone, Mistake::kPoseInverted, Mistake::kRotationTurned,
          Mistake::kTranslationTurned, Mistake::kImagesExchanged, Mistake::kCamerasExchanged})
        evidence.trials.push_back(try_rig(fitting, evidence.matches, mistake));
}

Evidence collect_evidence(const std::vector<StereoFrame>& frames, StereoCalibration calibration,
                          std::string refusal) {
    Evidence evidence = begin_evidence(frames.front());
    evidence.compression = signs_of_compression(frames);
    evidence.last_frame = frames.back().index;
    evidence.frame_count = frames.size();
    FramesToMatch to_match(frames.size());
    RepeatMeter repeats;
    for (const StereoFrame& frame : frames) {
        const BlankFrame look = look_of(frame);
        const RepeatedFrame repeated = repeats.add(frame);
        if (look.is_blank())
            evidence.blank_frames.push_back(look);
        else if (repeated.is_repeated())
            evidence.repeated_frames.push_back(repeated);
        if (to_match.takes(look.is_blank())) add_views(gray_views(frame), evidence);
    }
    add_calibration(std::move(calibration), std::move(refusal), evidence);
    return evidence;
}

}  // namespace defrec::cli
