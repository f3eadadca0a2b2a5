// `defrec evaluate` on the command line.
#include <CLI/CLI.hpp>
#include <memory>

#include "sdk/cli/commands/command_options.hpp"
#include "sdk/cli/commands/commands.hpp"
#include "sdk/evaluation/evaluate.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/terminal.hpp"

namespace defrec::cli {
namespace {

int print_data_sets() {
    std::string text;
    for (const auto& data_set : data_sets()) {
        std::string name = data_set->name();
        if (name.size() < 12) name.append(12 - name.size(), ' ');
        text += name + " " + data_set->summary() + "\n";
        text += std::string(13, ' ') + data_set->layout() + "\n";
    }
    print(text);
    return static_cast<int>(ExitCode::kOk);
}

int run(const EvaluateOptions& options) {
    if (options.data_set.empty()) {
        if (options.list) return print_data_sets();
        throw CliError(ExitCode::kUsage, "--dataset is required; --list names the data sets.");
    }
    if (options.root.empty())
        throw CliError(ExitCode::kUsage, "the folder of the data set is required: ROOT.");
    if (options.out.empty() && !options.list)
        throw CliError(ExitCode::kUsage, "--out is required: the folder for the results.");
    return run_evaluate(options);
}

void add_run_options(CLI::App& command, EvaluateOptions& options) {
    command
        .add_option_function<std::vector<std::string>>(
            "--method",
            [&options](const std::vector<std::string>& names) {
                options.methods.clear();
                for (const std::string& name : names)
                    options.methods.push_back(name == "opencv"  ? Method::kOpenCv
                                              : name == "still" ? Method::kStill
                                                                : Method::kDefrec);
            },
            "defrec; opencv: the baseline, Lucas-Kanade and StereoSGBM; still: the control, what "
            "the first frame shows stays; all may be given")
        ->type_name("NAME")
        ->check(CLI::IsMember({"defrec", "opencv", "still"}))
        ->allow_extra_args(false);
    command
        .add_option("--config", options.configs,
                    "YAML with parameters of the tracker; given again, every clip is run with each "
                    "and the effects are tabled")
        ->type_name("F")
        ->allow_extra_args(false);
    add_device_options(command, options.settings.backend, options.settings.device,
                       options.settings.threads);
    command.add_option("--seed", options.settings.seed, "Seed of the random choices")
        ->type_name("S")
        ->check(seed_number());
    command
        .add_option("--video", options.settings.video,
                    "Names of the videos in a clip, for data sets that do not fix them "
                    "(stir-2026: left.mp4,right.mp4)")
        ->type_name("NAMES");
    add_units_option(command, options.settings.units);
    command.add_option("--jobs", options.jobs, "Clips at the same time")
        ->type_name("N")
        ->check(CLI::Range(1, 1024))
        ->capture_default_str();
    command
        .add_option("--time-limit", options.time_limit_s,
                    "Seconds after which a clip is ended and put in quarantine")
        ->type_name("S")
        ->check(number_in(1e-3, 1e9))
        ->capture_default_str();
}

}  // namespace

CLI::App* add_evaluate_command(CLI::App& app, std::function<int()>& run_later) {
    auto options = std::make_shared<EvaluateOptions>();
    CLI::App* command =
        app.add_subcommand("evaluate", "Run a data set's clips and measure them by its metrics");
    command->add_option("ROOT", options->root, "The folder of the data set");
    command->add_option("--dataset", options->data_set, "Its name; --list names those there are")
        ->type_name("NAME");
    command->add_option("--out", options->out, "Folder for the results; created where absent")
        ->type_name("DIR");
    command
        ->add_option("--subset", options->subset,
                     "Only clips whose names match, with * and ?; may be repeated")
        ->type_name("PATTERN")
        ->allow_extra_args(false);
    add_run_options(*command, *options);
    command->add_flag("--resume", options->resume,
                      "Keep the clips that are done with the same options; run the others");
    auto* shard = command->add_option_function<std::string>(
        "--shard",
        [options](const std::string& text) {
            options->shard = parse_shard(text);
            options->is_sharded = true;
        },
        "Run only part I of N, 1/N to N/N, and merge nothing");
    shard->type_name("I/N");
    command
        ->add_flag("--merge", options->merge,
                   "Run nothing: merge what the shards left in DIR, with the options they had")
        ->excludes(shard);
    command->add_flag("--list", options->list,
                      "Print the names of the clips, or without --dataset those of the data sets");
    command->add_flag("--quiet", options->quiet, "Print nothing but errors");
    command->add_option("--clip", options->clip)->group("");  // for the process of one clip
    command->footer(
        "Every clip is run in a process of its own. One that fails, crashes or does not end is put "
        "in quarantine with its\n"
        "reason; --resume tries it again. One whose truth contradicts what was tracked is "
        "doubtful, "
        "and in no summary.\n"
        "Tables, page and clips of an earlier evaluation in DIR are replaced; --resume keeps the "
        "clips.\n"
        "Results in DIR: results.csv (a row for each clip), summary.csv (all clips together), "
        "times.csv, evaluation.html,\n"
        "with several --config effects.csv, and clips/, what each clip left.\n"
        "\n"
        "Examples:\n"
        "  defrec evaluate --dataset defrec sequences/ --out results\n"
        "  defrec evaluate --dataset defrec sequences/ --out results --shard 1/4\n"
        "  defrec evaluate --dataset defrec sequences/ --out results --merge\n"
        "\n"
        "Exit codes: 0 done, 2 usage, 3 the data set is not as expected, 6 done, but clips are in "
        "quarantine or doubtful\n"
        "(0 with --shard), 7 output failed, 130 interrupted.");
    command->callback([options, &run_later] { run_later = [options] { return run(*options); }; });
    return command;
}

}  // namespace defrec::cli
