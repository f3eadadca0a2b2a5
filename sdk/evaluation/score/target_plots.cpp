// Plots of the errors of targets over their depth.
#include "sdk/evaluation/score/target_plots.hpp"

#include <algorithm>
#include <cmath>

#include "sdk/evaluation/score/plot.hpp"
#include "sdk/evaluation/score/plot_page.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

double middle_of(const DepthScore& depth) { return (depth.min_depth + depth.max_depth) / 2; }

PlotAxis depth_axis(const TargetScore& score) {
    constexpr double kMargin = 0.04;
    double min = middle_of(score.depths.front()), max = middle_of(score.depths.back());
    if (min == max) {
        --min;
        ++max;
    }
    const double margin = kMargin * (max - min);
    return {"depth beneath the surface, mm", min - margin, max + margin, false};
}

// A value of each depth; depths without one are left out.
template <typename Value>
PlotLine line_over_depth(const TargetScore& score, const std::string& css_class,
                         const std::string& what, const Value& value_of) {
    PlotLine line{css_class, {}, {}};
    for (const DepthScore& depth : score.depths) {
        const double value = value_of(depth);
        if (std::isnan(value)) continue;
        line.points.push_back({middle_of(depth), value});
        line.titles.push_back(depth.name() + ": " + what + " " + format_fixed(value, 3) + " mm");
    }
    return line;
}

std::string error_section(const TargetScore& score) {
    Plot plot{"error of targets over depth", depth_axis(score), {"mm", 0, 1, false}, {}};
    plot.lines = {
        line_over_depth(score, "ideal", "median of the rigid fit",
                        [](const DepthScore& depth) { return depth.rigid.median; }),
        line_over_depth(score, "extrapolated", "expected error, mean",
                        [](const DepthScore& depth) { return depth.all.mean_expected_mm; }),
        line_over_depth(score, "other", "95th percentile of the error",
                        [](const DepthScore& depth) { return depth.all.errors.p95; }),
        line_over_depth(score, "tracked", "median error",
                        [](const DepthScore& depth) { return depth.all.errors.median; })};
    double max = 0;
    for (const PlotLine& line : plot.lines)
        for (const auto& [depth, value] : line.points) max = std::max(max, value);
    constexpr double kMargin = 1.05;
    plot.y.max = max > 0 ? kMargin * max : 1;
    return page_section(
        "Targets: error over depth",
        "Distance from the truth, and what was expected. Dashed: a target that moves with the best "
        "rigid fit of the true surface.",
        plot_svg(plot) +
            "<ul class=\"key\"><li class=\"tracked\">median error</li><li class=\"other\">95th "
            "percentile</li><li class=\"extrapolated\">mean expected error</li><li "
            "class=\"ideal\">rigid fit, median</li></ul>\n");
}

std::string coverage_section(const TargetScore& score) {
    static const char* const kClasses[3] = {"tracked", "other", "extrapolated"};
    Plot plot{"share of targets within 1, 2 and 3 expected errors over depth",
              depth_axis(score),
              {"share of targets, %", 0, 102, false},
              {}};
    for (int k = 0; k < 3; ++k) {
        PlotLine line{kClasses[k], {}, {}};
        for (const DepthScore& depth : score.depths) {
            const double share = 100 * depth.all.coverage.within[k];
            if (std::isnan(share)) continue;
            line.points.push_back({middle_of(depth), share});
            line.titles.push_back(depth.name() + ": " + format_fixed(share, 1) + " % within " +
                                  std::to_string(k + 1) + " expected errors");
        }
        plot.lines.push_back(std::move(line));
    }
    return page_section(
        "Targets: coverage over depth",
        "Share of the targets whose error is within 1, 2 and 3 expected errors. Expected errors "
        "hold where they are at least 55 %, 93 % and 98.5 %, and are too large where more than 85 "
        "% "
        "are within 1.",
        plot_svg(plot) +
            "<ul class=\"key\"><li class=\"tracked\">within 1</li><li class=\"other\">within "
            "2</li><li class=\"extrapolated\">within 3</li></ul>\n");
}

}  // namespace

std::string target_sections(const TargetScore& score) {
    if (score.all.all.errors.count == 0) return {};
    return error_section(score) + coverage_section(score);
}

}  // namespace defrec::cli
