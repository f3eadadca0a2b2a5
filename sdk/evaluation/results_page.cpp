// The page of an evaluation.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>

#include "sdk/base/util/markup.hpp"
#include "sdk/evaluation/results.hpp"
#include "sdk/evaluation/score/plot.hpp"
#include "sdk/evaluation/score/plot_page.hpp"
#include "sdk/io/counted.hpp"
#include "sdk/io/text.hpp"
#include "sdk/report/page_json.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kWorst = 10, kColours = 6;

constexpr char kMoreStyle[] = R"(
:root { --series4: #b4389c; --series5: #0e8aa5; }
@media (prefers-color-scheme: dark) { :root { --series4: #f08bdc; --series5: #5fd3ea; } }
.series4 { color: var(--series4); }
.series5 { color: var(--series5); }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: 3px 12px 3px 0; text-align: right; white-space: nowrap; }
th { color: var(--muted); font-weight: 500; }
th:first-child, td:first-child { text-align: left; }
td.text { text-align: left; white-space: normal; }
.worst { display: grid; grid-template-columns: repeat(auto-fill, minmax(320px, 1fr)); gap: 16px; }
figure { margin: 0; overflow-wrap: anywhere; }
figure img { max-width: 100%; border-radius: 6px; display: block; }
)";

std::string colour_of(std::size_t variant) {
    static const char* const kClasses[kColours] = {"tracked", "extrapolated", "other",
                                                   "all",     "series4",      "series5"};
    return kClasses[variant % kColours];
}

std::string number(double value) {
    if (std::isnan(value)) return "&ndash;";
    return format_fixed(value, 3);
}

std::string row(const std::string& tag, const std::vector<std::string>& cells) {
    std::string text = "<tr>";
    for (const std::string& cell : cells)
        text.append("<").append(tag).append(">").append(cell).append("</").append(tag).append(">");
    return text + "</tr>\n";
}

std::string overall_table(const Results& results) {
    std::vector<std::string> cells{""};
    for (const VariantResults& variant : results.variants)
        cells.push_back(escaped(variant.variant));
    std::string table = "<table>" + row("th", cells);
    const auto add = [&](const std::string& name, const auto& value_of) {
        cells = {escaped(name)};
        for (const VariantResults& variant : results.variants) cells.push_back(value_of(variant));
        table += row("td", cells);
    };
    add("clips", [](const VariantResults& v) { return std::to_string(v.clips.size()); });
    add("in quarantine", [](const VariantResults& v) { return std::to_string(v.quarantined()); });
    add("doubtful", [](const VariantResults& v) { return std::to_string(v.doubtful()); });
    for (std::size_t i = 0; i < results.metrics.size(); ++i)
        add(results.metrics[i].name, [&](const VariantResults& v) { return number(v.pooled[i]); });
    return page_section("All clips",
                        "Metrics of the samples of all clips together, but of those in quarantine "
                        "and doubtful ones; those of each clip are in results.csv.",
                        table + "</table>");
}

std::string effects_table(const Results& results) {
    if (results.variants.size() < 2) return {};
    std::vector<std::string> cells{"change from " + escaped(results.variants.front().variant)};
    for (const Metric& metric : results.metrics) cells.push_back(escaped(metric.name));
    cells.emplace_back("frame_ms");
    std::string table = "<table>" + row("th", cells);
    const VariantResults& first = results.variants.front();
    const auto change = [](double value, double from) {
        const double difference = value - from;
        if (std::isnan(difference)) return std::string("&ndash;");
        std::string text = difference >= 0 ? "+" : "";
        append_fixed(text, difference, 3);
        return text;
    };
    const auto interval = [](const PairedChange& by_clip) -> std::string {
        if (std::isnan(by_clip.low)) return {};
        return "<br><small>by clip " + format_fixed(by_clip.low, 3) + " to " +
               format_fixed(by_clip.high, 3) + "</small>";
    };
    for (std::size_t v = 1; v < results.variants.size(); ++v) {
        const VariantResults& variant = results.variants[v];
        cells = {escaped(variant.variant)};
        for (std::size_t i = 0; i < results.metrics.size(); ++i)
            cells.push_back(change(variant.pooled[i], first.pooled[i]) +
                            interval(change_of(first, variant, i)));
        cells.push_back(change(variant.frame_ms(), first.frame_ms()));
        table += row("td", cells);
    }
    return "<section class=\"wide\"><h2>Effects</h2><p class=\"hint\">Also in effects.csv. By "
           "clip: the mean over the clips that both did lies there in 95 of 100 draws of as many "
           "clips. Frame times differ from run to run.</p>" +
           table + "</table></section>\n";
}

std::string depth_table(const Results& results) {
    if (!results.has_depths()) return {};
    std::vector<std::string> cells{"depth", "variant"};
    for (const Metric& metric : results.depth_metrics) cells.push_back(escaped(metric.name));
    std::string table = "<table>" + row("th", cells);
    for (const VariantResults& variant : results.variants) {
        for (const DepthValues& depth : variant.depths) {
            cells = {escaped(depth.depth), escaped(variant.variant)};
            for (const double value : depth.values) cells.push_back(number(value));
            table += row("td", cells);
        }
    }
    return "<section class=\"wide\"><h2>Targets by depth</h2><p class=\"hint\">Of all clips "
           "together; those of each clip are in results_by_depth.csv. The rigid fit is that of the "
           "true visible surface.</p>" +
           table + "</table></section>\n";
}

// How many of the clips have at most this value.
std::string distribution(const Results& results, std::size_t metric) {
    constexpr double kMargin = 0.02;
    const std::string& name = results.metrics[metric].name;
    Plot plot{"share of clips with at most this " + name,
              {name, 0, 1, false},
              {"share of clips, %", 0, 102, false},
              {}};
    double min = INFINITY, max = -INFINITY;
    for (std::size_t v = 0; v < results.variants.size(); ++v) {
        std::vector<double> values;
        for (const ClipResult& clip : results.variants[v].clips)
            if (clip.outcome.counts() && std::isfinite(clip.values[metric]))
                values.push_back(clip.values[metric]);
        if (values.empty()) continue;
        std::sort(values.begin(), values.end());
        min = std::min(min, values.front());
        max = std::max(max, values.back());
        PlotLine line{colour_of(v), {{values.front(), 0}}, {}};
        const auto count = static_cast<double>(values.size());
        for (std::size_t i = 0; i < values.size(); ++i) {
            line.points.push_back({values[i], 100 * static_cast<double>(i) / count});
            line.points.push_back({values[i], 100 * static_cast<double>(i + 1) / count});
        }
        plot.lines.push_back(std::move(line));
    }
    if (!(max > min)) return {};
    const double margin = kMargin * (max - min);
    plot.x.min = min - margin;
    plot.x.max = max + margin;
    return page_section(escaped(name), "Clips with at most this value.", plot_svg(plot));
}

std::string image_of(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    if (bytes.empty()) return {};
    return "<img alt=\"\" src=\"data:image/jpeg;base64," + base64(bytes.data(), bytes.size()) +
           "\">";
}

std::string worst_clips(const Results& results, const VariantResults& variant) {
    std::vector<const ClipResult*> clips;
    for (const ClipResult& clip : variant.clips)
        if (clip.outcome.counts()) clips.push_back(&clip);
    const Metric& metric = results.metrics.front();
    std::stable_sort(clips.begin(), clips.end(), [&](const auto* a, const auto* b) {
        return is_worse(metric, a->values.front(), b->values.front());
    });
    clips.resize(std::min(clips.size(), kWorst));
    std::string figures;
    for (const ClipResult* clip : clips) {
        figures += "<figure>" + image_of(clip->folder / kPictureFile) + "<figcaption><b>" +
                   escaped(clip->clip) + "</b>, " + escaped(metric.name) + " " +
                   number(clip->values.front()) + "<br>" + escaped(clip->outcome.remark) +
                   "</figcaption></figure>\n";
    }
    if (figures.empty()) return {};
    return "<section class=\"wide\"><h2>The worst clips of " + escaped(variant.variant) +
           "</h2><p class=\"hint\">By " + escaped(metric.name) +
           ", each with its worst frame.</p><div class=\"worst\">" + figures + "</div></section>\n";
}

// The clips of which text_of() says something.
template <class TextOf>
std::string remarks(const Results& results, const std::string& title, const std::string& hint,
                    const TextOf& text_of) {
    std::string rows;
    for (const VariantResults& variant : results.variants) {
        for (const ClipResult& clip : variant.clips) {
            const std::string& text = text_of(clip.outcome);
            if (text.empty()) continue;
            rows += "<tr><td>" + escaped(clip.clip) + "</td><td>" + escaped(variant.variant) +
                    "</td><td class=\"text\">" + escaped(text) + "</td></tr>\n";
        }
    }
    if (rows.empty()) return {};
    return "<section class=\"wide\"><h2>" + title + "</h2><p class=\"hint\">" + hint +
           "</p><table>" + rows + "</table></section>\n";
}

std::string remarks_on_clips(const Results& results) {
    using Text = const std::string&;
    return remarks(results, "In quarantine",
                   "These clips did not come to an end and are in no metric.",
                   [](const Outcome& outcome) -> Text { return outcome.failure; }) +
           remarks(results, "Doubtful",
                   "The truth of these clips contradicts what was tracked. Their numbers probably "
                   "mean nothing: they are in results.csv and in no metric of all clips.",
                   [](const Outcome& outcome) -> Text { return outcome.doubt; }) +
           remarks(results, "Notes", "What else of a truth does not fit. These clips count.",
                   [](const Outcome& outcome) -> Text { return outcome.notes; });
}

std::string doubtful_banner(const Results& results) {
    std::size_t count = 0;
    for (const VariantResults& variant : results.variants) count += variant.doubtful();
    if (count == 0) return {};
    return "<p class=\"doubt\"><strong>" + counted(count, "clip") + (count == 1 ? " is" : " are") +
           " doubtful:</strong> the truth contradicts what was tracked.</p>\n";
}

}  // namespace

std::string results_page(const Results& results) {
    std::string page = page_head("defrec: evaluation", kMoreStyle) + "<header><h1>" +
                       escaped(results.data_set) + "</h1><p class=\"from\">" +
                       escaped(results.root) + "</p><ul class=\"key\">";
    for (std::size_t v = 0; v < results.variants.size(); ++v) {
        page +=
            "<li class=\"" + colour_of(v) + "\">" + escaped(results.variants[v].variant) + "</li>";
    }
    page += "</ul>" + doubtful_banner(results) + "</header>\n<main>\n" + remarks_on_clips(results) +
            overall_table(results) + effects_table(results) + depth_table(results);
    for (std::size_t i = 0; i < results.metrics.size(); ++i) page += distribution(results, i);
    for (const VariantResults& variant : results.variants) page += worst_clips(results, variant);
    return page + "</main>\n</body>\n</html>\n";
}

}  // namespace defrec::cli
