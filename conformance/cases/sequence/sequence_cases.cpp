// The sequence tier: reference sequences through the tracker, held against their truth and against
// the tracker on the reference.
#include <algorithm>

#include "conformance/cases/sequence/comparison.hpp"
#include "conformance/cases/sequence/sequence_list.hpp"
#include "conformance/worker/case.hpp"
#include "include/defrec_c.h"
#include "sdk/contract/enumerations.hpp"

namespace defrec::conformance {
namespace {

void measure(CaseRun& run, const std::string& quantity, double maximum, double p99,
             uint64_t samples) {
    const Tolerance& limit = run.tolerances().at(quantity);
    run.measure({quantity, limit.unit, maximum, p99, limit.maximum, limit.p99, samples});
}

void against_truth(CaseRun& run, const SequenceEntry& entry, const Track& found) {
    const RenderedSequence& film = rendered_sequence(entry.sequence);
    const TruthErrors truth = errors_to_truth(found, film);
    const std::string kind = entry.error_limits();
    const double median = quantile(truth.errors, 0.5), p95 = quantile(truth.errors, 0.95);
    measure(run, "sequence.error_" + kind, quantile(truth.errors, 1), quantile(truth.errors, 0.99),
            truth.errors.size());
    measure(run, "sequence.error_p95_" + kind, p95, p95, truth.errors.size());
    measure(run, "sequence.error_median_" + kind, median, median, truth.errors.size());
    measure(run, "sequence.error_observed", quantile(truth.observed, 1),
            quantile(truth.observed, 0.99), truth.observed.size());
    measure(run, "sequence.lost_visible", truth.lost_share(), truth.lost_share(), truth.visible);
}

void against_reference(CaseRun& run, const SequenceEntry& entry, const Track& expected,
                       const Track& found) {
    const StateDifference states = state_difference(expected, found);
    if (!states.other_state.empty()) return run.note_failure(states.other_state);
    const TrackDistance apart = distance_between(expected, found);
    const std::string kind = entry.spread_limits();
    if (entry.hazy)
        measure(run, "sequence.other_reasons_hazy", states.other_reasons, states.other_reasons,
                found.frames.size());
    else if (states.other_reasons > 0)
        run.note_failure(states.reasons_message);
    measure(run, "sequence.other_contradicted", states.other_contradicted,
            states.other_contradicted, found.frames.size());
    const double median = quantile(apart.observed, 0.5);
    measure(run, "sequence.observed" + kind, quantile(apart.observed, 1),
            quantile(apart.observed, 0.99), apart.observed.size());
    measure(run, "sequence.observed_median" + kind, median, median, apart.observed.size());
    measure(run, "sequence.extrapolated" + kind, quantile(apart.extrapolated, 1),
            quantile(apart.extrapolated, 0.99), apart.extrapolated.size());
    measure(run, "sequence.other_evidence" + kind, apart.other_status_share(),
            apart.other_status_share(), apart.vertices);
    const bool passed = std::all_of(run.metrics.begin(), run.metrics.end(),
                                    [](const Metric& metric) { return metric.passed(); });
    if (passed && run.failure.empty()) return;
    const double scale = run.tolerances().at("sequence.observed" + kind).p99;
    for (Picture& picture : distance_pictures(expected, found, rendered_sequence(entry.sequence),
                                              apart.worst_frame, scale))
        run.show(std::move(picture));
}

// What the frames of a scene without tissue in them must be, whatever the reference says.
void lost_without_tissue(const RenderedSequence& film, const Track& found) {
    for (size_t i = 0; i < film.frames.size(); ++i) {
        if (film.frames[i].shows_tissue) continue;
        const TrackedFrame& frame = found.frames[i];
        require(frame.state == DEFREC_LOST, "frame ", i, " shows no tissue and has state ",
                frame.state, ", lost expected");
        for (const uint8_t status : frame.vertex_status)
            require(status == DEFREC_POINT_UNKNOWN, "frame ", i,
                    " shows no tissue, and a vertex has status ", uint32_t(status),
                    ", unknown expected");
    }
}

bool has_reason(const Track& track, uint32_t reason) {
    return std::any_of(track.frames.begin(), track.frames.end(),
                       [&](const TrackedFrame& frame) { return (frame.reasons & reason) != 0; });
}

template <class T>
void digest(CaseRun& run, const std::vector<T>& values) {
    run.digest(std::as_bytes(std::span(values)));
}

void digest(CaseRun& run, const Track& track) {
    digest(run, std::vector<uint64_t>{track.template_digest});
    for (const TrackedFrame& frame : track.frames) {
        digest(run, std::vector<uint32_t>{frame.state, frame.reasons, frame.epoch, frame.age,
                                          frame.template_epoch});
        digest(run, frame.vertices);
        digest(run, frame.vertex_status);
        digest(run, frame.expected_error);
        digest(run, frame.points);
        digest(run, frame.point_status);
    }
}

void follow(CaseRun& run, const SequenceEntry& entry) {
    const defrec_device_info& device = run.subject().info();
    if ((device.stages & kEveryStage) != kEveryStage)
        skip_case("the device does not offer every stage, which tracking needs");
    const RenderedSequence& film = rendered_sequence(entry.sequence);
    const Track found = track({run.subject_plugin().files().manifest, device.id}, film);
    const Track& expected =
        kept_track({run.reference_plugin().files().manifest, run.reference().info().id}, film);
    digest(run, found);
    lost_without_tissue(film, found);
    require(entry.reason == 0 || has_reason(found, entry.reason), "no frame has reason ",
            entry.reason, ", which the scene is to give");
    require(found.template_digest == expected.template_digest,
            "the template captured from the first frame is not the reference's");
    against_truth(run, entry, found);
    against_reference(run, entry, expected, found);
}

}  // namespace

void add_sequence_cases(std::vector<Case>& cases) {
    for (const SequenceEntry& entry : sequence_list()) {
        const SequenceRequest& film = entry.sequence;
        cases.push_back({concat("sequence/", film.scene, "_", film.width, "x", film.height),
                         "sequence", "", entry.title, entry.smoke, true,
                         [&entry](CaseRun& run) { follow(run, entry); }, entry.since});
    }
}

}  // namespace defrec::conformance
