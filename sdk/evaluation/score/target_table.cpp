// The score of targets as text.
#include "sdk/evaluation/score/table_line.hpp"
#include "sdk/evaluation/score/target_score.hpp"

namespace defrec::cli {
namespace {

TableLine errors_line(const std::string& name, const TargetErrors& errors) {
    TableLine line(name);
    line.count(errors.errors.count);
    for (const double value :
         {errors.errors.median, errors.errors.p95, errors.errors.max, errors.mean_expected_mm})
        line.number(value, 3);
    for (const double share : errors.coverage.within) line.percent(share);
    return line;
}

std::string depth_lines(const std::string& name, const DepthScore& depth) {
    std::string lines = errors_line(name, depth.all)
                            .percent(depth.lost_share())
                            .number(depth.rigid.median, 3)
                            .number(depth.rigid.p95, 3)
                            .end();
    for (const TargetErrors& status : depth.statuses)
        lines += errors_line("  " + status.status, status).end();
    return lines;
}

}  // namespace

std::string target_verdict(const TargetScore& score) {
    const DepthScore& all = score.all;
    if (all.all.errors.count == 0) return "All targets were lost.\n";
    return verdict_on("targets", all.all.errors, all.lost, all.rows);
}

std::string target_table(const TargetScore& score) {
    std::string table = table_header("targets by depth, mm",
                                     {"points", "median", "p95", "max", "expected", "within 1",
                                      "within 2", "within 3", "lost", "rigid", "rigid p95"});
    for (const DepthScore& depth : score.depths) table += depth_lines(depth.name(), depth);
    if (score.depths.size() > 1) table += depth_lines("all", score.all);
    return table + judgement_lines(confidences_of(score));
}

}  // namespace defrec::cli
