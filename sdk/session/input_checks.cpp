// See input_checks.hpp.
#include "sdk/session/input_checks.hpp"

#include <exception>
#include <utility>

#include "sdk/doctor/doctor.hpp"
#include "sdk/doctor/findings.hpp"

namespace defrec::cli {

InputChecks::InputChecks(StereoCalibration calibration, const defrec_camera& camera,
                         std::function<void(std::string)> show)
    : calibration_(std::move(calibration)), camera_(camera), show_(std::move(show)) {}

void InputChecks::add(const StereoFrame& frame, const defrec_result& result,
                      const CompressionWatch& compression) {
    if (next_ == 0) {
        evidence_ = begin_evidence(frame);
        count_ = frames_to_look_at(evidence_.width, evidence_.height);
        to_match_ = FramesToMatch(count_);
    }
    if (next_ == count_) return;
    record_.add(result, frame.left.width, frame.left.height);
    const RepeatedFrame repeated = repeats_.add(frame);
    const BlankFrame look = record_.last().is_lit() ? BlankFrame() : look_of(frame);
    if (look.is_blank())
        blank_frames_.push_back(look);
    else if (repeated.is_repeated())
        repeated_frames_.push_back(repeated);
    if (to_match_.takes(look.is_blank()))
        thread_.add(
            [this, views = gray_views(frame)] { attempt([&] { add_views(views, evidence_); }); });
    if (++next_ < count_) return;
    thread_.add([this, last = frame.index, probe = record_.probe(true, camera_),
                 compression = compression.signs()] {
        attempt([&] {
            evidence_.last_frame = last;
            evidence_.frame_count = count_;
            evidence_.blank_frames = blank_frames_;
            evidence_.repeated_frames = repeated_frames_;
            evidence_.probe = probe;
            evidence_.compression = compression;
            add_calibration(calibration_, {}, evidence_);
        });
        conclude();
    });
}

void InputChecks::attempt(const std::function<void()>& work) {
    try {
        if (failure_.empty()) work();
    } catch (const std::exception& error) {
        failure_ = std::string("they broke off: ") + error.what();
    }
}

void InputChecks::conclude() {
    std::vector<Finding> findings;
    attempt([&] { findings = look_at_everything(evidence_); });
    if (!failure_.empty())
        findings = {Look("checks", "checks", Severity::kWarning).unknown(failure_)};
    show_(diagnosis_json({count_, evidence_.width, evidence_.height, std::move(findings)}));
    evidence_ = {};
}

}  // namespace defrec::cli
