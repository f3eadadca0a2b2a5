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

std::size_t TrackProbe::frames_with(std::uint32_t reasons) const {
    return static_cast<std::size_t>(
        std::count_if(frames.begin(), frames.end(),
                      [&](const TrackedFrame& frame) { return (frame.reasons & reasons) != 0; }));
}

double TrackProbe::share_without_depth() const {
    double sum = 0;
    for (const TrackedFrame& frame : frames) sum += 1 - frame.depth_share;
    return sum / static_cast<double>(std::max<std::size_t>(frames.size(), 1));
}

const RigTrial& Evidence::without(Mistake mistake) const {
    return *std::find_if(trials.begin(), trials.end(),
                         [&](const RigTrial& trial) { return trial.mistake == mistake; });
}

bool Evidence::has_depth() const {
    return has_trials() && as_given().front_share >= decisions::DoctorOrder::kMinFront;
}

std::size_t frames_to_look_at(int width, int height) {
    using Decision = decisions::DoctorSample;
    const double pixels = static_cast<double>(width) * height;
    return static_cast<std::size_t>(
        std::clamp(static_cast<std::int64_t>(Decision::kTrackedPixels / pixels),
                   Decision::kMinFrames, Decision::kMaxFrames));
}

std::vector<std::size_t> frames_to_match(std::size_t count) {
    const std::size_t matched =
        std::min<std::size_t>(count, decisions::DoctorSample::kMatchedFrames);
    std::vector<std::size_t> frames;
    for (std::size_t i = 0; i < matched; ++i)
        frames.push_back(matched > 1 ? i * (count - 1) / (matched - 1) : 0);
    return frames;
}

Evidence begin_evidence(const StereoFrame& first) {
    Evidence evidence;
    evidence.width = first.left.width;
    evidence.height = first.left.height;
    evidence.fields = fields_of(first);
    evidence.first_frame = first.index;
    return evidence;
}

BlackFrame black_views(const StereoFrame& frame) {
    const auto is_black = [](const ImageView& view) {
        return cv::mean(gray_of(view))[0] < decisions::DoctorImages::kBlack;
    };
    return {frame.index, is_black(frame.left), is_black(frame.right)};
}

GrayPair gray_views(const StereoFrame& frame) {
    const auto gray = [](const ImageView& view) {
        return view.channels == 1 ? mat_of(view).clone() : gray_of(view);
    };
    return {gray(frame.left), gray(frame.right)};
}

void add_views(GrayPair views, Evidence& evidence) {
    const std::vector<ViewMatch> found = match_views(views.left, views.right);
    evidence.matches.insert(evidence.matches.end(), found.begin(), found.end());
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
    const StereoCalibration fitting =
        evidence.has_other_size ? scaled(evidence.calibration, evidence.width, evidence.height)
                                : evidence.calibration;
    for (const Mistake mistake :
         {Mistake::kNone, Mistake::kPoseInverted, Mistake::kRotationTurned,
          Mistake::kTranslationTurned, Mistake::kImagesExchanged, Mistake::kCamerasExchanged})
        evidence.trials.push_back(try_rig(fitting, evidence.matches, mistake));
}

Evidence collect_evidence(const std::vector<StereoFrame>& frames, StereoCalibration calibration,
                          std::string refusal) {
    Evidence evidence = begin_evidence(frames.front());
    evidence.compression = signs_of_compression(frames);
    evidence.frame_count = frames.size();
    for (const StereoFrame& frame : frames)
        if (const BlackFrame black = black_views(frame); black.left || black.right)
            evidence.black_frames.push_back(black);
    for (const std::size_t i : frames_to_match(frames.size()))
        add_views(gray_views(frames[i]), evidence);
    add_calibration(std::move(calibration), std::move(refusal), evidence);
    return evidence;
}

}  // namespace defrec::cli
