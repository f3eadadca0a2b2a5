// See input_checks.hpp.
#include "sdk/session/input_checks.hpp"

#include <algorithm>
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
        to_match_ = frames_to_match(count_);
    }
    if (next_ == count_) return;
    record_.add(result, frame.left.width, frame.left.height);
    if ((result.reasons & DEFREC_REASON_DARK) != 0) black_frames_.push_back(black_views(frame));
    if (std::binary_search(to_match_.begin(), to_match_.end(), next_))
        thread_.add(
            [this, views = gray_views(frame)] { attempt([&] { add_views(views, evidence_); }); });
    if (++next_ < count_) return;
    thread_.add([this, probe = record_.probe(true, camera_), compression = compression.signs()] {
        attempt([&] {
            evidence_.frame_count = count_;
            evidence_.black_frames = black_frames_;
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
