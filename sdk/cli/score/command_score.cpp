// `defrec score` on the command line.
#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>

#include "sdk/base/atomic_file.hpp"
#include "sdk/cli/io/exit_code.hpp"
#include "sdk/cli/io/json_text.hpp"
#include "sdk/cli/io/terminal.hpp"
#include "sdk/cli/program/commands.hpp"
#include "sdk/cli/score/score.hpp"
#include "sdk/cli/score/score_report.hpp"

namespace defrec::cli {
namespace {

struct ScoreOptions {
    std::string folder, truth, report;
    ScoreLimits limits;
    FrameRange range;
    bool json = false, quiet = false;
};

int run_score(const ScoreOptions& options) {
    const Score score = score_of(read_scored_rows(options.folder, options.truth, options.range));
    if (!options.report.empty())
        write_atomically(options.report, score_page(score, options.folder, options.truth));
    const std::string message = exceeded(score, options.limits);
    if (options.json) {
        nlohmann::ordered_json json = score_json(score);
        json["passed"] = message.empty();
        print(json_text(json, 2) + "\n");
    } else if (!options.quiet) {
        print(score_table(score));
    }
    if (message.empty()) return static_cast<int>(ExitCode::kOk);
    print_notice(message);
    return static_cast<int>(ExitCode::kBelowThreshold);
}

}  // namespace

CLI::App* add_score_command(CLI::App& app, std::function<int()>& run) {
    auto options = std::make_shared<ScoreOptions>();
    CLI::App* command = app.add_subcommand("score", "Measure tracked points against the truth");
    command
        ->add_option("DIR", options->folder,
                     "What `defrec track --out` wrote: points.csv, frames.csv")
        ->required();
    command
        ->add_option("--truth", options->truth,
                     "CSV frame,id,x,y,z,visible, as `defrec render` writes it")
        ->type_name("F")
        ->required();
    command
        ->add_option("--max-median", options->limits.max_median_mm,
                     "Exit 6 when the median over visible points is larger")
        ->type_name("MM");
    command
        ->add_option("--max-p95", options->limits.max_p95_mm,
                     "Exit 6 when their 95th percentile is larger")
        ->type_name("MM");
    command->add_flag("--calibrated", options->limits.calibrated,
                      "Exit 6 when a status' expected errors do not hold");
    command
        ->add_option_function<std::string>(
            "--frames",
            [options](const std::string& text) { options->range = parse_frame_range(text); },
            "Only frames A to B-1 of the truth")
        ->type_name("A:B");
    command
        ->add_option("--report", options->report,
                     "Write a page with plots: reliability, coverage, sparsification")
        ->type_name("F.html");
    command->add_flag("--json", options->json, "Print JSON instead of a table");
    command->add_flag("--quiet", options->quiet, "Print nothing but what exceeds a limit");
    command->footer(
        "A visible point counts as lost when it has no row, no position or status lost. Hidden "
        "points are those that the\n"
        "truth says cannot be seen.\n"
        "Expected errors hold when 55 to 85 % of the points are within 1, at least 93 % within 2 "
        "and 98.5 % within 3 of\n"
        "them, for each status with 100 points or more.\n"
        "\n"
        "Examples:\n"
        "  defrec score result --truth sequence/truth.csv\n"
        "  defrec score result --truth sequence/truth.csv --max-median 0.3 --max-p95 1.5 && echo "
        "good enough");
    command->callback([options, &run] { run = [options] { return run_score(*options); }; });
    return command;
}

}  // namespace defrec::cli
