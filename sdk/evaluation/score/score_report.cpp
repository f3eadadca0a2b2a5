// A page with the plots of a score.
#include "sdk/evaluation/score/score_report.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "sdk/base/util/markup.hpp"
#include "sdk/evaluation/score/plot.hpp"
#include "sdk/evaluation/score/plot_page.hpp"
#include "sdk/evaluation/score/reliability.hpp"
#include "sdk/evaluation/score/sparsification.hpp"
#include "sdk/evaluation/score/target_plots.hpp"
#include "sdk/io/text.hpp"
#include "sdk/session/track_outputs.hpp"

namespace defrec::cli {
namespace {

// Its CSS class, which gives the colour.
std::string class_of(const std::string& status) {
    for (const PointStatus known : {PointStatus::kTracked, PointStatus::kExtrapolated}) {
        if (status == name_of(known)) return status;
    }
    return "other";
}

std::string key_of(const Score& score) {
    std::string key = "<ul class=\"key\">";
    for (const auto& [status, samples] : score.samples) {
        key += "<li class=\"" + class_of(status) + "\">" + escaped(status) + ", " +
               std::to_string(samples.size()) + " points</li>";
    }
    return key + "</ul>\n";
}

std::string reliability_section(const Score& score) {
    constexpr std::size_t kMaxBins = 12, kMinCount = 20;
    Plot plot{"expected error against measured error", {}, {}, {}};
    double min = INFINITY, max = 0;
    for (const auto& [status, samples] : score.samples) {
        PlotLine line{class_of(status), {}, {}};
        for (const ReliabilityBin& bin : reliability_of(samples, kMaxBins, kMinCount)) {
            // The axes are logarithmic.
            if (bin.expected_mm <= 0 || bin.measured_mm <= 0) continue;
            line.points.push_back({bin.expected_mm, bin.measured_mm});
            line.titles.push_back(status + ", " + std::to_string(bin.count) + " points: expected " +
                                  format_fixed(bin.expected_mm, 3) + " mm, measured " +
                                  format_fixed(bin.measured_mm, 3) + " mm");
            min = std::min({min, bin.expected_mm, bin.measured_mm});
            max = std::max({max, bin.expected_mm, bin.measured_mm});
        }
        plot.lines.push_back(std::move(line));
    }
    if (max == 0) return {};
    constexpr double kMargin = 1.2;
    plot.x = {"expected error, mm", min / kMargin, max * kMargin, true};
    plot.y = {"root mean square of the error, mm", min / kMargin, max * kMargin, true};
    plot.lines.insert(plot.lines.begin(),
                      {"ideal", {{plot.x.min, plot.x.min}, {plot.x.max, plot.x.max}}, {}});
    return page_section(
        "Reliability",
        "Points in bins of equal count, by their expected error. On the dashed line the "
        "measured error is the expected one; above it points claim too much.",
        plot_svg(plot));
}

std::string coverage_section(const Score& score) {
    constexpr double kMaxRatio = 4, kStep = 0.05;
    Plot plot{"share of points within k expected errors",
              {"k", 0, kMaxRatio, false},
              {"share of points within k expected errors, %", 0, 102, false},
              {}};
    for (int k = 1; k <= 3; ++k) {
        plot.lines.push_back({"band",
                              {{double(k), 100 * CoverageBands::kMinWithin[k - 1]},
                               {double(k), k == 1 ? 100 * CoverageBands::kMaxWithinOne : 100.0}},
                              {}});
    }
    for (const auto& [status, samples] : score.samples) {
        const std::vector<double> ratios = ratios_of(samples);
        if (ratios.empty()) continue;
        PlotLine line{class_of(status), {}, {}};
        for (double k = 0; k <= kMaxRatio + kStep / 2; k += kStep)
            line.points.push_back({k, 100 * share_within(ratios, k)});
        plot.lines.push_back(std::move(line));
    }
    return page_section(
        "Coverage",
        "Expected errors hold where the lines pass through the three bars: 55 to 85 % "
        "within 1, at least 93 % within 2 and 98.5 % within 3 expected errors. Below a bar they "
        "are too small; above the first they are too large, which is safe.",
        plot_svg(plot));
}

std::string sparsification_section(const Score& score) {
    constexpr std::size_t kMaxPoints = 200;
    constexpr double kMaxMean = 3;  // the last few points may have any mean
    std::vector<ErrorSample> all;
    for (const auto& [status, samples] : score.samples)
        all.insert(all.end(), samples.begin(), samples.end());
    const Sparsification curves = sparsification_of(all);
    const std::size_t count = curves.by_true.size();
    if (count == 0) return {};
    const auto line_of = [&](const std::string& css_class, const std::vector<double>& means) {
        PlotLine line{css_class, {}, {}};
        const std::size_t steps = std::min(count, kMaxPoints);
        for (std::size_t i = 0; i < steps; ++i) {
            const std::size_t k = i * count / steps;
            line.points.push_back(
                {100 * static_cast<double>(k) / static_cast<double>(count), means[k]});
        }
        return line;
    };
    const double highest = *std::max_element(curves.by_expected.begin(), curves.by_expected.end());
    const Plot plot{
        "mean error of what is left against the share removed",
        {"share of points removed, %", 0, 100, false},
        {"mean error of the rest / of all", 0, std::clamp(highest, 1.0, kMaxMean), false},
        {line_of("ideal", curves.by_true), line_of("all", curves.by_expected)}};
    return page_section(
        "Sparsification",
        "All points: the largest expected errors are removed first; dashed: the largest "
        "true errors. The area between the lines is AUSE, " +
            format_fixed(ause_of(curves), 3) + ".",
        plot_svg(plot));
}

// Sentences among the lines of a table break where the table would scroll.
std::string table_section(const std::string& table) {
    std::istringstream lines(table);
    std::string text, line;
    while (std::getline(lines, line)) {
        const bool is_sentence = !line.empty() && line.find("  ") == std::string::npos;
        text += is_sentence ? "<span class=\"sentence\">" + escaped(line) + "</span>\n"
                            : escaped(line) + "\n";
    }
    return "<section class=\"wide\"><pre>" + text + "</pre></section>\n";
}

std::string doubt_of(const TruthDoubt& doubt) {
    return doubt.note.empty() ? std::string()
                              : "<p class=\"doubt\"><strong>" + std::string(kDoubt) + "</strong> " +
                                    escaped(doubt.note) + "</p>\n";
}

std::string list_of(const std::vector<std::string>& notes) {
    std::string list;
    for (const std::string& note : notes) list += "<li>" + escaped(note) + "</li>";
    return list.empty() ? list : "<ul class=\"notes\">" + list + "</ul>\n";
}

}  // namespace

std::vector<std::string> notes_beside_doubts(const Scores& scores) {
    std::vector<std::string> notes;
    const auto add = [&](const auto& score) {
        for (const std::string& note : score.notes)
            if (note != score.doubt.note) notes.push_back(note);
    };
    if (scores.points) add(*scores.points);
    if (scores.targets) add(*scores.targets);
    return notes;
}

std::string score_page(const Scores& scores, const std::string& folder, const std::string& truth) {
    std::string page = page_head("defrec: score") + "<header><h1>" + escaped(folder) +
                       "</h1><p class=\"from\">scored against " + escaped(truth) + "</p>";
    if (scores.points) page += doubt_of(scores.points->doubt);
    if (scores.targets) page += doubt_of(scores.targets->doubt);
    const auto add_verdict = [&page](const std::string& verdict) {
        page += "<p class=\"verdict\">" + escaped(verdict) + "</p>\n";
    };
    if (scores.points) add_verdict(score_verdict(*scores.points));
    if (scores.targets) add_verdict(target_verdict(*scores.targets));
    page += list_of(notes_beside_doubts(scores));
    if (scores.points) page += key_of(*scores.points);
    page += "</header>\n<main>\n";
    if (scores.points) {
        page += reliability_section(*scores.points) + coverage_section(*scores.points) +
                sparsification_section(*scores.points);
    }
    if (scores.targets) page += target_sections(*scores.targets);
    if (scores.points) page += table_section(score_tables(*scores.points));
    if (scores.targets) page += table_section(target_table(*scores.targets));
    return page + "</main>\n</body>\n</html>\n";
}

}  // namespace defrec::cli
