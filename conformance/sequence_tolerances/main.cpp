// The program defrec_sequence_tolerances, which derives the tolerances of the sequence tier: it
// tracks every sequence of the tier on the reference, and again on the reference whose lm moves
// every control point by a random amount below --jitter, and prints tolerances.yaml's entries.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <map>

#include "conformance/cases/sequence/comparison.hpp"
#include "conformance/cases/sequence/sequence_list.hpp"
#include "conformance/cases/stress/relayed.hpp"
#include "sdk/base/util/error.hpp"

namespace {

using namespace defrec;
using namespace defrec::conformance;

constexpr double kSpreadFactor = 4, kErrorFactor = 1.5;

struct Worst {
    double maximum = 0, p99 = 0;

    void add(double other_maximum, double other_p99) {
        maximum = std::max(maximum, other_maximum);
        p99 = std::max(p99, other_p99);
    }
};

// Two significant digits, not below.
double rounded_up(double value) {
    if (value <= 0) return 0;
    const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
    return std::ceil(value / unit - 1e-9) * unit;
}

class Derivation {
  public:
    Derivation(double jitter_mm, unsigned seeds)
        : jitter_(jitter_mm),
          seeds_(seeds),
          plugin_(find_backend("reference"), ""),
          device_{plugin_.files().manifest, "reference"},
          relayed_{relay_manifest(), "reference"} {}

    void add(const SequenceEntry& entry) {
        const RenderedSequence& film = rendered_sequence(entry.sequence);
        const Track expected = track(device_, film);
        add_errors(entry, errors_to_truth(expected, film));
        for (unsigned seed = 1; seed <= seeds_; ++seed) {
            RelayCounts counts;
            RelayPlan plan;
            plan.counts = &counts;
            plan.jitter_mm = jitter_;
            plan.jitter_seed = seed;
            arm_relay(plugin_, plan);
            const Track moved = track(relayed_, film);
            add_spread(entry, expected, moved);
        }
    }

    void print() const {
        for (const auto& [name, worst] : errors_)
            print(name, worst, kErrorFactor, "mm",
                  "1.5 times the reference's own worst over the tier's sequences");
        for (const auto& [name, worst] : spread_)
            print(name, worst, kSpreadFactor, unit_of(name),
                  "4 times the largest spread of the reference over the tier's sequences");
    }

  private:
    void add_errors(const SequenceEntry& entry, const TruthErrors& truth) {
        errors_["sequence.error_" + entry.error_limits()].add(quantile(truth.errors, 1),
                                                              quantile(truth.errors, 0.99));
        std::fprintf(
            stderr, "%s %ux%u: error median %.4f, p95 %.4f, p99 %.4f, maximum %.4f mm, lost %.4f\n",
            entry.sequence.scene.c_str(), entry.sequence.width, entry.sequence.height,
            quantile(truth.errors, 0.5), quantile(truth.errors, 0.95), quantile(truth.errors, 0.99),
            quantile(truth.errors, 1), truth.lost_share());
    }

    void add_spread(const SequenceEntry& entry, const Track& expected, const Track& moved) {
        const std::string kind = entry.spread_limits();
        const StateDifference states = state_difference(expected, moved);
        if (!states.other_state.empty())
            throw std::runtime_error(entry.sequence.scene + ": " + states.other_state);
        const TrackDistance apart = distance_between(expected, moved);
        const double median = quantile(apart.observed, 0.5), status = apart.other_status_share();
        spread_["sequence.observed" + kind].add(quantile(apart.observed, 1),
                                                quantile(apart.observed, 0.99));
        spread_["sequence.observed_median" + kind].add(median, median);
        spread_["sequence.extrapolated" + kind].add(quantile(apart.extrapolated, 1),
                                                    quantile(apart.extrapolated, 0.99));
        spread_["sequence.other_evidence" + kind].add(status, status);
        spread_["sequence.other_reasons" + kind].add(states.other_reasons, states.other_reasons);
        spread_["sequence.other_contradicted"].add(states.other_contradicted,
                                                   states.other_contradicted);
        std::fprintf(stderr,
                     "  observed median %.5f, p99 %.4f, maximum %.4f mm; extrapolated p99 %.4f, "
                     "maximum %.4f mm; status %.5f; "
                     "reasons %u\n",
                     median, quantile(apart.observed, 0.99), quantile(apart.observed, 1),
                     quantile(apart.extrapolated, 0.99), quantile(apart.extrapolated, 1), status,
                     states.other_reasons);
    }

    static const char* unit_of(const std::string& name) {
        return name.find("evidence") != std::string::npos ? "share"
               : name.find("other_") != std::string::npos ? "frames"
                                                          : "mm";
    }

    void print(const std::string& name, const Worst& worst, double factor, const char* unit,
               const char* how) const {
        if (worst.maximum == 0) return;  // exact
        std::printf(
            "%s:\n  unit: %s\n  maximum: %.3g\n  p99: %.3g\n  provenance: %s (%.3g, p99 %.3g)\n  "
            "command: defrec_sequence_tolerances --jitter %g --seeds %u\n",
            name.c_str(), unit, rounded_up(factor * worst.maximum), rounded_up(factor * worst.p99),
            how, worst.maximum, worst.p99, jitter_, seeds_);
    }

    double jitter_;
    unsigned seeds_;
    Plugin plugin_;
    TrackingDevice device_, relayed_;
    std::map<std::string, Worst> errors_, spread_;
};

}  // namespace

int main(int argc, char** argv) {
    double jitter = 2e-4;
    unsigned seeds = 4;
    CLI::App app("Derives the tolerances of the sequence tier from the reference");
    app.add_option("--jitter", jitter, "mm")->capture_default_str();
    app.add_option("--seeds", seeds, "jittered runs of each sequence")->capture_default_str();
    CLI11_PARSE(app, argc, argv);
    try {
        Derivation derivation(jitter, seeds);
        for (const SequenceEntry& entry : sequence_list()) derivation.add(entry);
        derivation.print();
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
