// See doctor.hpp.
#include "sdk/doctor/doctor.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "sdk/client/library.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/pairings.hpp"
#include "sdk/input/bag_calibration.hpp"
#include "sdk/io/interrupt.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/terminal.hpp"

namespace defrec::cli {
namespace {

std::vector<StereoFrame> read_frames(const SourceOptions& options) {
    FrameSource source(options);
    const std::size_t count = frames_to_look_at(source.width(), source.height());
    std::vector<StereoFrame> frames;
    StereoFrame frame;
    while (frames.size() < count && source.next(frame)) {
        throw_if_interrupted();
        frames.push_back(frame);
    }
    if (!source.fault().empty()) throw CliError(ExitCode::kInput, source.fault());
    return frames;
}

const char* verdict_name(Verdict verdict) {
    switch (verdict) {
        case Verdict::kFine:
            return "fine";
        case Verdict::kFound:
            return "found";
        default:
            return "unknown";
    }
}

std::string conclusion(const Diagnosis& diagnosis) {
    std::size_t problems = 0, warnings = 0, unknown = 0;
    for (const Finding& finding : diagnosis.findings) {
        if (finding.verdict == Verdict::kUnknown) ++unknown;
        if (finding.verdict != Verdict::kFound) continue;
        ++(finding.severity == Severity::kError ? problems : warnings);
    }
    std::string text = problems > 0   ? "Mend what is a problem before tracking: "
                       : warnings > 0 ? "It can be tracked, less well than it could: "
                       : unknown > 0  ? "Nothing found, as far as could be seen: "
                                      : "Nothing found: ";
    text += std::to_string(diagnosis.findings.size()) + " things looked at in " +
            std::to_string(diagnosis.frames) + " frames";
    const auto add = [&](std::size_t count, const char* one, const char* more) {
        if (count > 0) text += ", " + std::to_string(count) + (count == 1 ? one : more);
    };
    add(problems, " problem", " problems");
    add(warnings, " warning", " warnings");
    add(unknown, " unknown", " unknown");
    return text + ".";
}

}  // namespace

std::size_t Diagnosis::found() const {
    return static_cast<std::size_t>(
        std::count_if(findings.begin(), findings.end(),
                      [](const Finding& finding) { return finding.verdict == Verdict::kFound; }));
}

Diagnosis diagnose(const DoctorOptions& options) {
    const WrittenCalibration written = written_calibration(options.source, options.calibration);
    const std::vector<StereoFrame> frames = read_frames(options.source);
    StereoCalibration accepted;
    std::string refusal;
    try {
        accepted = load_calibration(written, options.units);
        fit_to_frames(accepted, frames.front().left.width, frames.front().left.height);
    } catch (const CliError& error) {
        refusal = error.what();
    }
    const bool is_accepted = refusal.empty();
    TrackProbe probe =
        track_frames(options.probe, frames, is_accepted ? &accepted : nullptr, refusal);
    Evidence evidence = collect_evidence(frames, read_calibration(written, options.units), refusal);
    evidence.probe = std::move(probe);
    try_pairings(frames, evidence);
    return {frames.size(), evidence.width, evidence.height, look_at_everything(evidence)};
}

std::string diagnosis_text(const Diagnosis& diagnosis) {
    std::string text;
    for (const Finding& finding : diagnosis.findings) {
        const char* mark = finding.verdict == Verdict::kFine ? "ok       "
                           : finding.verdict == Verdict::kFound
                               ? finding.severity == Severity::kError ? "PROBLEM  " : "WARNING  "
                               : "unknown  ";
        text += mark + finding.title + ": " + finding.what + "\n";
        if (!finding.remedy.empty()) text += "         -> " + finding.remedy + "\n";
    }
    return text + conclusion(diagnosis) + "\n";
}

std::string diagnosis_json(const Diagnosis& diagnosis) {
    nlohmann::ordered_json all;
    all["frames"] = diagnosis.frames;
    all["width"] = diagnosis.width;
    all["height"] = diagnosis.height;
    all["found"] = diagnosis.found();
    all["findings"] = nlohmann::ordered_json::array();
    for (const Finding& finding : diagnosis.findings) {
        nlohmann::ordered_json each;
        each["id"] = finding.id;
        each["title"] = finding.title;
        each["verdict"] = verdict_name(finding.verdict);
        each["severity"] = finding.severity == Severity::kError ? "error" : "warning";
        each["what"] = finding.what;
        each["remedy"] = finding.remedy;
        each["value"] = nullptr;
        if (finding.value) each["value"] = *finding.value;
        each["unit"] = finding.unit;
        all["findings"].push_back(std::move(each));
    }
    return json_text(all, 2) + "\n";
}

int run_doctor(const DoctorOptions& options) {
    const Diagnosis diagnosis = diagnose(options);
    if (!options.quiet) print(options.json ? diagnosis_json(diagnosis) : diagnosis_text(diagnosis));
    return static_cast<int>(diagnosis.found() == 0 ? ExitCode::kOk : ExitCode::kFound);
}

}  // namespace defrec::cli
