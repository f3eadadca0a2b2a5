// The results of all clips as tables.
#include "sdk/evaluation/results.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "sdk/evaluation/score/percentile.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

// A field of a file without quoting. A spreadsheet takes what begins like a formula for one, unless
// an apostrophe stands before it.
std::string field(const std::string& given) {
    constexpr std::string_view kFormula = "=+-@\t\r";
    std::string text;
    if (!given.empty() && kFormula.find(given.front()) != std::string_view::npos) text += '\'';
    text += given;
    for (char& c : text) {
        if (c == ',') c = ';';
        if (c == '\n' || c == '\r') c = ' ';
    }
    return text;
}

using Fields = std::vector<std::string>;

std::string line_of(const Fields& fields) {
    std::string line;
    for (std::size_t i = 0; i < fields.size(); ++i) {
        if (i > 0) line += ',';
        line += fields[i];
    }
    line += '\n';
    return line;
}

void add_names(const std::vector<Metric>& metrics, Fields& fields) {
    for (const Metric& metric : metrics) fields.push_back(metric.name);
}

// In quarantine there are none.
void add_values(const std::vector<Metric>& metrics, const std::vector<double>& values,
                Fields& fields) {
    for (std::size_t i = 0; i < metrics.size(); ++i)
        fields.push_back(i < values.size() ? exact(values[i]) : std::string());
}

// A row for each depth, which begins with `names`.
std::string depth_lines(const Results& results, const Fields& names,
                        const std::vector<DepthValues>& depths) {
    std::string text;
    for (const DepthValues& depth : depths) {
        Fields fields = names;
        fields.push_back(depth.depth);
        add_values(results.depth_metrics, depth.values, fields);
        text += line_of(fields);
    }
    return text;
}

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double frame_ms_of(const ClipResult& clip) {
    return clip.outcome.failure.empty() ? clip.outcome.frame_ms.median : kNone;
}

const char* status_of(const Outcome& outcome) {
    if (!outcome.is_done()) return "quarantined";
    return outcome.counts() ? "done" : "doubtful";
}

template <class ValueOf>
PairedChange change_by_clip(const VariantResults& first, const VariantResults& second,
                            const ValueOf& value_of) {
    std::map<std::string, double> of_first;
    for (const ClipResult& clip : first.clips) of_first[clip.clip] = value_of(clip);
    std::vector<double> before, after;
    for (const ClipResult& clip : second.clips) {
        const auto found = of_first.find(clip.clip);
        before.push_back(found != of_first.end() ? found->second : kNone);
        after.push_back(value_of(clip));
    }
    return paired_change(before, after);
}

}  // namespace

PairedChange change_of(const VariantResults& first, const VariantResults& second,
                       std::size_t metric) {
    return change_by_clip(first, second, [metric](const ClipResult& clip) {
        return clip.outcome.counts() && metric < clip.values.size() ? clip.values[metric] : kNone;
    });
}

std::size_t VariantResults::quarantined() const {
    return static_cast<std::size_t>(
        std::count_if(clips.begin(), clips.end(),
                      [](const ClipResult& clip) { return !clip.outcome.failure.empty(); }));
}

std::size_t VariantResults::doubtful() const {
    return static_cast<std::size_t>(std::count_if(
        clips.begin(), clips.end(),
        [](const ClipResult& clip) { return clip.outcome.is_done() && !clip.outcome.counts(); }));
}

double VariantResults::frame_ms() const {
    std::vector<double> times;
    for (const ClipResult& clip : clips) {
        if (clip.outcome.failure.empty() && !std::isnan(clip.outcome.frame_ms.median))
            times.push_back(clip.outcome.frame_ms.median);
    }
    std::sort(times.begin(), times.end());
    return percentile(times, 0.5);
}

double VariantResults::seconds() const {
    double sum = 0;
    for (const ClipResult& clip : clips) sum += clip.outcome.seconds;
    return sum;
}

bool Results::has_depths() const {
    return std::any_of(variants.begin(), variants.end(),
                       [](const VariantResults& variant) { return !variant.depths.empty(); });
}

bool is_worse(const Metric& metric, double a, double b) {
    if (std::isnan(a) || std::isnan(b)) return std::isnan(a) && !std::isnan(b);
    return metric.larger_is_better ? a < b : a > b;
}

std::string results_csv(const Results& results) {
    Fields header{"variant", "clip", "status", "frames"};
    add_names(results.metrics, header);
    header.insert(header.end(), {"reason", "notes"});
    std::string text = line_of(header);
    for (const VariantResults& variant : results.variants) {
        for (const ClipResult& clip : variant.clips) {
            const Outcome& outcome = clip.outcome;
            Fields fields{field(variant.variant), field(clip.clip), status_of(outcome),
                          std::to_string(outcome.frames)};
            add_values(results.metrics, clip.values, fields);
            fields.push_back(field(outcome.is_done() ? outcome.doubt : outcome.failure));
            fields.push_back(field(outcome.notes));
            text += line_of(fields);
        }
    }
    return text;
}

std::string summary_csv(const Results& results) {
    Fields header{"variant", "clips", "quarantined", "doubtful"};
    add_names(results.metrics, header);
    std::string text = line_of(header);
    for (const VariantResults& variant : results.variants) {
        Fields fields{field(variant.variant), std::to_string(variant.clips.size()),
                      std::to_string(variant.quarantined()), std::to_string(variant.doubtful())};
        add_values(results.metrics, variant.pooled, fields);
        text += line_of(fields);
    }
    return text;
}

std::string results_by_depth_csv(const Results& results) {
    Fields header{"variant", "clip", "depth"};
    add_names(results.depth_metrics, header);
    std::string text = line_of(header);
    for (const VariantResults& variant : results.variants) {
        for (const ClipResult& clip : variant.clips)
            text += depth_lines(results, {field(variant.variant), field(clip.clip)}, clip.depths);
    }
    return text;
}

std::string summary_by_depth_csv(const Results& results) {
    Fields header{"variant", "depth"};
    add_names(results.depth_metrics, header);
    std::string text = line_of(header);
    for (const VariantResults& variant : results.variants)
        text += depth_lines(results, {field(variant.variant)}, variant.depths);
    return text;
}

std::string times_csv(const Results& results) {
    std::string text = "variant,clip,frames,frame_ms,frame_p95_ms,seconds\n";
    for (const VariantResults& variant : results.variants) {
        for (const ClipResult& clip : variant.clips) {
            text +=
                line_of({field(variant.variant), field(clip.clip),
                         std::to_string(clip.outcome.frames), exact(clip.outcome.frame_ms.median),
                         exact(clip.outcome.frame_ms.p95), format_fixed(clip.outcome.seconds, 3)});
        }
    }
    return text;
}

std::string effects_csv(const Results& results) {
    std::string text = "variant,metric,value,first,change,clips,clip_change,low,high\n";
    const VariantResults& first = results.variants.front();
    const auto add = [&](const VariantResults& variant, const std::string& metric, double value,
                         double of_first, const PairedChange& change) {
        text += line_of({field(variant.variant), metric, exact(value), exact(of_first),
                         exact(value - of_first), std::to_string(change.clips), exact(change.mean),
                         exact(change.low), exact(change.high)});
    };
    for (const VariantResults& variant : results.variants) {
        for (std::size_t i = 0; i < results.metrics.size(); ++i)
            add(variant, results.metrics[i].name, variant.pooled[i], first.pooled[i],
                change_of(first, variant, i));
        add(variant, "frame_ms", variant.frame_ms(), first.frame_ms(),
            change_by_clip(first, variant, frame_ms_of));
    }
    return text;
}

std::string results_text(const Results& results) {
    constexpr std::size_t kNameWidth = 20, kWidth = 15;
    std::string text(kNameWidth, ' ');
    const auto add_cell = [&](const std::string& cell) {
        text.append(std::max(kWidth, cell.size() + 1) - cell.size(), ' ').append(cell);
    };
    for (const VariantResults& variant : results.variants) add_cell(variant.variant);
    text += '\n';
    const auto add = [&](const std::string& name, const auto& value_of) {
        text += name;
        text.append(kNameWidth - std::min(kNameWidth, name.size()), ' ');
        for (const VariantResults& variant : results.variants) add_cell(value_of(variant));
        text += '\n';
    };
    add("clips", [](const VariantResults& v) { return std::to_string(v.clips.size()); });
    add("quarantined", [](const VariantResults& v) { return std::to_string(v.quarantined()); });
    add("doubtful", [](const VariantResults& v) { return std::to_string(v.doubtful()); });
    const auto number = [](double value, int decimals) {
        return std::isnan(value) ? std::string("-") : format_fixed(value, decimals);
    };
    for (std::size_t i = 0; i < results.metrics.size(); ++i) {
        add(results.metrics[i].name,
            [&](const VariantResults& v) { return number(v.pooled[i], 4); });
    }
    add("frame_ms", [&](const VariantResults& v) { return number(v.frame_ms(), 1); });
    add("clips_per_hour", [&](const VariantResults& v) {
        return number(3600 * static_cast<double>(v.clips.size()) / v.seconds(), 0);
    });
    return text;
}

}  // namespace defrec::cli
