// The results of all clips: tables and the page.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "sdk/evaluation/clip_store.hpp"
#include "sdk/evaluation/data_sets/data_set.hpp"
#include "sdk/evaluation/score/paired_bootstrap.hpp"

namespace defrec::cli {

struct ClipResult {
    std::string clip;
    Outcome outcome;
    std::vector<double> values;         // of the metrics; empty in quarantine
    std::filesystem::path folder;       // of what it left
    std::vector<DepthValues> depths{};  // ascending; empty without targets
};

struct VariantResults {
    std::string variant;
    std::vector<ClipResult> clips;      // in name order
    std::vector<double> pooled;         // the metrics of all samples of clips that count together
    std::vector<DepthValues> depths{};  // likewise

    std::size_t quarantined() const;
    std::size_t doubtful() const;  // done, with a truth in doubt
    // The median over clips of their frames' median; NaN where none is known.
    double frame_ms() const;
    double seconds() const;  // of all processes
};

struct Results {
    std::string data_set, root;
    std::vector<Metric> metrics;
    std::vector<VariantResults> variants;
    std::vector<Metric> depth_metrics{};

    bool has_depths() const;  // of any clip
};

// How a metric changed, over the clips that both did.
PairedChange change_of(const VariantResults& first, const VariantResults& second,
                       std::size_t metric);

// Whether `a` is worse than `b`; NaN is worst.
bool is_worse(const Metric& metric, double a, double b);

// results.csv: a row for each clip; summary.csv: a row for each variant. The same samples give the
// same bytes.
std::string results_csv(const Results& results);
std::string summary_csv(const Results& results);
// results_by_depth.csv and summary_by_depth.csv: a row for each depth of each clip, and of each
// variant. The same samples give the same bytes.
std::string results_by_depth_csv(const Results& results);
std::string summary_by_depth_csv(const Results& results);
// times.csv: frames, median and 95th percentile of the time of a frame, and time of the process,
// of each clip.
std::string times_csv(const Results& results);
// effects.csv: each metric of each variant, beside that of the first, and how sure the change is.
std::string effects_csv(const Results& results);
// For a person, a few lines.
std::string results_text(const Results& results);

// evaluation.html. With pictures of the worst clips.
std::string results_page(const Results& results);

}  // namespace defrec::cli
