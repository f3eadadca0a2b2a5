// Scores as text.
#include "sdk/evaluation/score/score.hpp"
#include "sdk/evaluation/score/table_line.hpp"
#include "sdk/io/counted.hpp"
#include "sdk/io/text.hpp"
#include "sdk/session/track_outputs.hpp"

namespace defrec::cli {
namespace {

TableLine errors_line(const std::string& name, const ErrorSummary& summary) {
    TableLine line(name);
    line.count(summary.count);
    for (const double value :
         {summary.median, summary.mean, summary.rmse, summary.p95, summary.max})
        line.number(value, 3);
    return line;
}

std::string errors_table(const Score& score) {
    std::string table =
        table_header("errors in mm", {"points", "median", "mean", "rmse", "p95", "max", "lost"});
    const auto add = [&](const std::string& indent, const ScoreGroup& group, bool with_hidden) {
        table += errors_line(indent + "visible", group.visible).percent(group.lost_share()).end();
        if (with_hidden) table += errors_line(indent + "hidden", group.hidden).end();
    };
    add("", score.all, true);
    for (const ScoreGroup& group : score.states)
        add("  " + group.name + " ", group, group.hidden.count > 0);
    table += counted(score.all.frames, "frame");
    if (score.frames_without_visible > 0) {
        table += ", " + std::to_string(score.frames_without_visible) +
                 " of them without a visible point (not counted in lost)";
    }
    return table + "\n";
}

std::string confidence_table(const Score& score) {
    std::string table = table_header(
        "expected errors",
        {"points", "within 1", "within 2", "within 3", "rms ratio", "p99 ratio", "ause"});
    const auto add = [&](const std::string& indent, const StatusConfidence& confidence) {
        const Coverage& coverage = confidence.coverage;
        TableLine line(indent + confidence.status);
        line.count(coverage.count);
        for (const double share : coverage.within) line.percent(share);
        line.number(coverage.rms_ratio, 2).number(coverage.p99_ratio, 2).number(confidence.ause, 3);
        table += line.end();
    };
    const auto add_group = [&](const std::string& indent, const ScoreGroup& group) {
        for (const StatusConfidence& status : group.statuses) add(indent, status);
        if (group.statuses.size() > 1) add(indent, group.all_statuses);
    };
    add_group("", score.all);
    for (const ScoreGroup& group : score.states) add_group("  " + group.name + " ", group);
    table += judgement_lines(score.all.statuses);
    const TrackedErrors& tracked = score.all.tracked;
    if (tracked.count > 0) {
        table += std::to_string(tracked.off) + " of " + std::to_string(tracked.count) + " " +
                 name_of(PointStatus::kTracked) + (tracked.count == 1 ? " point" : " points") +
                 (tracked.off == 1 ? " is" : " are") + " off by more than " +
                 format_fixed(TrackedErrors::kOffMm, 0) + " mm, the worst by " +
                 format_fixed(tracked.max, 3) + " mm\n";
    }
    return table;
}

std::string visibility_table(const Visibility& visibility) {
    std::vector<std::string> columns{"average"};
    for (const double distance : kJaccardDistances) columns.push_back(format_fixed(distance, 0));
    std::string table = table_header("jaccard at a distance of", columns);
    const auto add = [&](const std::string& name, const Jaccard& jaccard) {
        TableLine line(name);
        line.percent(jaccard.average);
        for (const double share : jaccard.at) line.percent(share);
        table += line.end();
    };
    add("mm", visibility.mm);
    if (visibility.px) add("px", *visibility.px);
    return table + "occlusion accuracy " + format_fixed(100 * visibility.occlusion_accuracy, 2) +
           " % of " + std::to_string(visibility.count) + " points\n";
}

}  // namespace

std::string score_verdict(const Score& score) {
    const ScoreGroup& all = score.all;
    if (all.visible_points == 0) return "No point was visible, so there is nothing to compare.\n";
    if (all.visible.count == 0) return "All visible points were lost.\n";
    return verdict_on("visible points", all.visible, all.lost_visible, all.visible_points);
}

std::string score_tables(const Score& score) {
    return errors_table(score) + "\n" + confidence_table(score) + "\n" +
           visibility_table(score.all.visibility);
}

}  // namespace defrec::cli
