// `defrec score` on the command line.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/cli/commands/commands.hpp"
#include "sdk/evaluation/score/score.hpp"
#include "sdk/evaluation/score/score_report.hpp"
#include "sdk/evaluation/score/target_score.hpp"
#include "sdk/evaluation/score/truth_origin.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/number_checks.hpp"
#include "sdk/io/output_folder.hpp"
#include "sdk/io/terminal.hpp"
#include "sdk/io/text.hpp"
#include "sdk/session/track_outputs.hpp"
#include "sdk/session/written_files.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFooter =
    "A visible point counts as lost in a frame where it has no row, no position or status lost. "
    "Points of the truth\n"
    "without a row in any frame are not measured, but for --all-points. Hidden points are those "
    "that the truth says\n"
    "cannot be seen.\n"
    "Expected errors hold when at least 55 % of the points are within 1, 93 % within 2 and 98.5 % "
    "within 3 of them,\n"
    "for each status with 100 points or more. With more than 85 % within 1 they are too large, "
    "which is said and is no\n"
    "failure.\n"
    "\n"
    "Targets are listed by depth, beside a target that moves with the best rigid fit of the "
    "true visible surface\n"
    "(rigid), from the first frame on.\n"
    "\n"
    "Examples:\n"
    "  defrec score result --truth sequence/truth.csv\n"
    "  defrec score result --truth sequence/truth.csv --max-median 0.3 --max-p95 1.5 && echo "
    "good enough\n"
    "\n"
    "Exit codes: 0 done, also where the truth is in doubt, 2 usage, 3 input unreadable, or surely "
    "the "
    "truth of something\n"
    "else, 6 done, but worse than a limit, 7 output failed.";

struct ScoreOptions {
    std::string folder, truth, truth_deep, report;
    ScoreLimits limits, deep_limits;
    FrameRange range;
    bool all_points = false, json = false, brief = false, quiet = false;

    Unfollowed unfollowed() const { return all_points ? Unfollowed::kLost : Unfollowed::kLeftOut; }
};

// Which truth is compared. A path that is empty: none.
struct Truth {
    fs::path surface;    // of points.csv
    fs::path deep;       // of targets.csv
    fs::path reference;  // of the surface, for the rigid fit that targets are compared with
};

fs::path sibling_of(const std::string& path, const char* name) {
    const fs::path sibling = fs::path(path).replace_filename(name);
    std::error_code error;
    return fs::exists(sibling, error) ? sibling : fs::path();
}

Truth truth_of(const ScoreOptions& options) {
    if (options.truth.empty() && options.truth_deep.empty())
        throw CliError(ExitCode::kUsage, "give the truth as --truth F, --truth-deep F, or both.");
    if (options.truth.empty() && options.limits.any()) {
        throw CliError(ExitCode::kUsage,
                       "--max-median, --max-p95 and --calibrated are about points; give their "
                       "truth as --truth F.");
    }
    Truth truth{options.truth, options.truth_deep, options.truth};
    std::error_code error;
    const fs::path targets = fs::path(options.folder) / kTargetsFile;
    if (!truth.deep.empty() && !fs::exists(targets, error) &&
        fs::exists(fs::path(options.folder) / kPlanFile, error))
        throw CliError(ExitCode::kInput,
                       targets.string() +
                           ": there is no such file. The run followed a plan, and plans are not "
                           "scored; give their places as --targets of `defrec track` as well.");
    if (truth.deep.empty() && fs::exists(targets, error))
        truth.deep = sibling_of(options.truth, kDeepTruthFile);
    if (truth.reference.empty()) truth.reference = sibling_of(options.truth_deep, "truth.csv");
    if (truth.deep.empty() && options.deep_limits.any()) {
        throw CliError(ExitCode::kUsage,
                       "--max-deep-median, --max-deep-p95 and --deep-calibrated are about targets; "
                       "give their truth as --truth-deep F.");
    }
    return truth;
}

std::vector<std::string> notes_of(const Scores& scores) {
    std::vector<std::string> notes;
    if (scores.points) notes = scores.points->notes;
    if (scores.targets)
        notes.insert(notes.end(), scores.targets->notes.begin(), scores.targets->notes.end());
    return notes;
}

// Numbers that mean nothing are not given where that is certain, or where summary.json says so too.
void refuse_other_truth(const TruthDoubt& doubt, const ScoreOptions& options, const fs::path& truth,
                        bool are_points) {
    if (doubt.note.empty()) return;
    if (doubt.is_certain) {
        if (options.all_points) return;
        throw CliError(ExitCode::kInput,
                       doubt.note + " With --all-points what has no row counts as lost.");
    }
    const auto [why, remedy] = contradiction_of(options.folder, truth, are_points);
    if (!why.empty()) throw CliError(ExitCode::kInput, why + ": " + doubt.note + " " + remedy);
}

std::string doubts_of(const Scores& scores) {
    std::string text;
    const auto add = [&](const TruthDoubt& doubt) {
        if (!doubt.note.empty())
            text += "WARNING. " + std::string(kDoubt) + " " + printable(doubt.note) + "\n";
    };
    if (scores.points) add(scores.points->doubt);
    if (scores.targets) add(scores.targets->doubt);
    return text;
}

std::string text_of(const Scores& scores, bool is_brief) {
    std::string verdict;
    if (scores.points) verdict = score_verdict(*scores.points);
    if (scores.targets) verdict += target_verdict(*scores.targets);
    for (const std::string& note : notes_beside_doubts(scores))
        verdict += "Note: " + printable(note) + "\n";
    std::string text;
    const auto add = [&text](const std::string& part) {
        text += text.empty() || part.empty() ? part : "\n" + part;
    };
    add(doubts_of(scores));
    add(verdict);
    if (scores.points && !is_brief) add(score_tables(*scores.points));
    if (scores.targets && !is_brief) add(target_table(*scores.targets));
    return text;
}

nlohmann::ordered_json json_of(const Scores& scores) {
    nlohmann::ordered_json json = nlohmann::ordered_json::object();
    if (scores.points) json = score_json(*scores.points);
    if (scores.targets) json["targets"] = target_json(*scores.targets);
    return json;
}

void refuse_recording(const fs::path& folder) {
    const auto has = [&](const char* name) {
        std::error_code error;
        return fs::exists(folder / name, error);
    };
    if (has(kFramesFile) || has(kSummaryFile)) return;
    if (has("left") || has("calibration.yaml")) {
        throw CliError(ExitCode::kInput,
                       folder.string() +
                           ": this is a recording, and no result of defrec track; give the folder "
                           "of its --out.");
    }
}

int run_score(const ScoreOptions& options) {
    const Truth truth = truth_of(options);
    const fs::path folder(options.folder);
    refuse_recording(folder);
    keep_apart({truth.surface, truth.deep, truth.reference, folder / kPointsFile,
                folder / kTargetsFile, folder / kFramesFile, folder / kSummaryFile},
               {options.report});
    if (!options.quiet)
        for (const std::string& name :
             not_as_summarised(folder, {kPointsFile, kTargetsFile, kFramesFile}))
            print_notice((folder / name).string() +
                         ": this file is not as summary.json says; it is of another run, or was "
                         "changed.");
    Scores scores;
    std::vector<std::string> messages;
    if (!truth.surface.empty()) {
        scores.points = score_of(
            read_scored_rows(options.folder, truth.surface, options.range, options.unfollowed()));
        refuse_other_truth(scores.points->doubt, options, truth.surface, true);
        messages = exceeded(*scores.points, options.limits);
    }
    if (!truth.deep.empty()) {
        scores.targets =
            target_score_of(read_scored_targets(folder / kTargetsFile, truth.deep, truth.reference,
                                                options.range, options.unfollowed()));
        refuse_other_truth(scores.targets->doubt, options, truth.deep, false);
        for (std::string& message : exceeded(*scores.targets, options.deep_limits))
            messages.push_back(std::move(message));
    }
    if (options.json && !options.quiet)
        for (const std::string& note : notes_of(scores)) print_notice(note);
    // Also where the numbers go into a file.
    if (!options.json && !options.quiet)
        if (const std::string doubts = doubts_of(scores); !doubts.empty())
            print_notice(doubts.substr(0, doubts.size() - 1));
    if (!options.report.empty()) {
        write_atomically(options.report,
                         score_page(scores, options.folder,
                                    (truth.surface.empty() ? truth.deep : truth.surface).string()));
    }
    const std::string message = joined(messages);
    if (options.json) {
        nlohmann::ordered_json json = json_of(scores);
        json["passed"] = message.empty();
        print(json_text(json, 2) + "\n");
    } else if (!options.quiet) {
        print(text_of(scores, options.brief));
    }
    if (message.empty()) return static_cast<int>(ExitCode::kOk);
    print_notice(message);
    return static_cast<int>(ExitCode::kBelowThreshold);
}

void add_limit_options(CLI::App& command, ScoreOptions& options) {
    command
        .add_option("--max-median", options.limits.max_median_mm,
                    "Exit 6 when the median over visible points is larger")
        ->type_name("MM")
        ->check(any_number());
    command
        .add_option("--max-p95", options.limits.max_p95_mm,
                    "Exit 6 when their 95th percentile is larger")
        ->type_name("MM")
        ->check(any_number());
    command.add_flag("--calibrated", options.limits.calibrated,
                     "Exit 6 when a status' expected errors are too small");
    command
        .add_option("--max-deep-median", options.deep_limits.max_median_mm,
                    "Exit 6 when the median over targets is larger at any depth")
        ->type_name("MM")
        ->check(any_number());
    command
        .add_option("--max-deep-p95", options.deep_limits.max_p95_mm,
                    "Exit 6 when their 95th percentile is larger at any depth")
        ->type_name("MM")
        ->check(any_number());
    command.add_flag("--deep-calibrated", options.deep_limits.calibrated,
                     "Exit 6 when a status' expected errors are too small at any depth of targets");
}

}  // namespace

CLI::App* add_score_command(CLI::App& app, std::function<int()>& run) {
    auto options = std::make_shared<ScoreOptions>();
    CLI::App* command =
        app.add_subcommand("score", "Measure tracked points and targets against the truth");
    command
        ->add_option("DIR", options->folder,
                     "What `defrec track --out` wrote: points.csv, frames.csv, targets.csv")
        ->required();
    command
        ->add_option("--truth", options->truth,
                     "CSV frame,id,x,y,z,visible, as `defrec render` writes it")
        ->type_name("F");
    command
        ->add_option("--truth-deep", options->truth_deep,
                     "CSV frame,id,depth,x,y,z of targets; default: truth_deep.csv beside --truth, "
                     "where DIR has targets.csv")
        ->type_name("F");
    add_limit_options(*command, *options);
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
    command->add_flag("--all-points", options->all_points,
                      "Count points of the truth without a row in any frame as lost");
    command->add_flag("--json", options->json, "Print JSON instead of a table");
    command->add_flag("--brief", options->brief, "Print a sentence and the notes, without tables");
    command->add_flag("--quiet", options->quiet, "Print nothing but what exceeds a limit");
    command->footer(kFooter);
    command->callback([options, &run] { run = [options] { return run_score(*options); }; });
    return command;
}

}  // namespace defrec::cli
