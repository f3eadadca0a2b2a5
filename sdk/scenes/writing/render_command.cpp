// The command line of `defrec render`.
#include "sdk/scenes/writing/render_command.hpp"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include "sdk/io/number_checks.hpp"
#include "sdk/scenes/writing/layouts.hpp"

namespace defrec::cli {
namespace {

constexpr int kExitUsage = 2;
constexpr int kExitOutput = 7;
constexpr int kExitStopped = 130;

struct Arguments {
    RenderOptions options;
    std::string size = "960x540";
    std::vector<std::string> settings;
    bool list = false;
    bool quiet = false;
};

void print_scenes() {
    for (const SceneInfo& scene : list_scenes()) {
        std::printf("%-15s  %s\n", scene.name.c_str(), scene.summary.c_str());
        for (const SceneParameter& p : scene.parameters) {
            const char* space = p.unit.empty() ? "" : " ";
            std::printf("%17s--set %s=%g  %s (%g to %g%s%s)\n", "", p.name.c_str(), p.initial,
                        p.summary.c_str(), p.lowest, p.highest, space, p.unit.c_str());
        }
    }
}

void parse_size(const std::string& text, RenderOptions& options) {
    int used = 0;
    if (std::sscanf(text.c_str(), "%4dx%4d%n", &options.width, &options.height, &used) != 2 ||
        static_cast<std::size_t>(used) != text.size()) {
        throw RenderUsageError("'" + text + "' is not a size; write it as 960x540");
    }
}

SceneSetting parse_setting(const std::string& text) {
    const std::size_t equals = text.find('=');
    char* end = nullptr;
    const double value =
        equals == std::string::npos ? 0 : std::strtod(text.c_str() + equals + 1, &end);
    if (end != text.c_str() + text.size() || equals == 0 || equals + 1 == text.size()) {
        throw RenderUsageError("'" + text + "' is not a setting; write it as NAME=NUMBER");
    }
    return {text.substr(0, equals), value};
}

int run_render(Arguments& arguments, const StopFn& stop) {
    if (arguments.list) {
        print_scenes();
        return 0;
    }
    try {
        if (arguments.options.scene.empty()) {
            throw RenderUsageError("no scene was named; 'defrec render --list' names them");
        }
        parse_size(arguments.size, arguments.options);
        arguments.options.settings.clear();
        for (const std::string& setting : arguments.settings) {
            arguments.options.settings.push_back(parse_setting(setting));
        }
        const bool show = !arguments.quiet && isatty(STDERR_FILENO) != 0;
        bool complete = false;
        const auto report = [&](int done, int total) {
            complete = done == total;
            if (show) {
                std::fprintf(stderr, "\r%s: frame %d of %d%s", arguments.options.scene.c_str(),
                             done, total, complete ? "\n" : "");
            }
        };
        const int written = render_sequence(arguments.options, report, stop);
        if (!complete) {
            std::fprintf(stderr, "%sdefrec render: stopped after %d frames, which are whole\n",
                         show ? "\n" : "", written);
            return kExitStopped;
        }
    } catch (const RenderUsageError& error) {
        std::fprintf(stderr, "defrec render: %s\n", error.what());
        return kExitUsage;
    } catch (const RenderOutputError& error) {
        std::fprintf(stderr, "defrec render: %s\n", error.what());
        return kExitOutput;
    }
    return 0;
}

}  // namespace

std::vector<std::string> scene_names() {
    std::vector<std::string> names;
    for (const SceneInfo& scene : list_scenes()) names.push_back(scene.name);
    return names;
}

CLI::App* add_render_command(CLI::App& app, std::function<int()>& run, const StopFn& stop) {
    CLI::App* command =
        app.add_subcommand("render", "Write a reference sequence: stereo images with exact truth");
    const auto arguments = std::make_shared<Arguments>();
    RenderOptions& options = arguments->options;
    command->add_option("scene", options.scene, "Name of the scene (see --list)");
    command->add_option("--out", options.out_dir, "Folder to write to; created where absent");
    command->add_option("--size", arguments->size, "Width x height of the images")
        ->capture_default_str();
    command
        ->add_option("--frames", options.frames, "Number of frames; 0: the scene's own number, 60")
        ->capture_default_str();
    command
        ->add_option("--set", arguments->settings,
                     "NAME=NUMBER: a parameter of the scene (see --list); may be repeated")
        ->allow_extra_args(false);
    command->add_option("--seed", options.seed, "Another seed is another organ")
        ->check(seed_number())
        ->capture_default_str();
    command->add_option("--threads", options.threads, "0: all; the result does not depend on it")
        ->capture_default_str();
    command
        ->add_option("--points-at", options.points_at,
                     "Also follow points of this frame's image, on tissue that the first image did "
                     "not show; may be repeated")
        ->type_name("FRAME")
        ->allow_extra_args(false);
    command->add_flag("--depth", options.depth,
                      "Also write disparity/: 16-bit PNG, 256 x px, 0 unknown");
    command
        ->add_option_function<std::string>(
            "--interlaced",
            [&options](const std::string& order) {
                options.fields =
                    order == "top-first" ? FieldOrder::kTopFirst : FieldOrder::kBottomFirst;
            },
            "Interlaced images: rows of two times half a frame apart, top-first or bottom-first; "
            "truth.csv then has a frame for each field")
        ->type_name("ORDER")
        ->check(CLI::IsMember({"top-first", "bottom-first"}));
    std::vector<std::string> layouts = public_layouts();
    layouts.insert(layouts.begin(), options.layout);
    command
        ->add_option("--layout", options.layout,
                     "Of a public data set, with its truth, for `defrec evaluate`")
        ->check(CLI::IsMember(layouts))
        ->capture_default_str();
    command->add_flag("--list", arguments->list, "Name the scenes with their parameters and stop");
    command->add_flag("--quiet", arguments->quiet, "No progress");
    command->footer(
        "Example: defrec render heartbeat --out /tmp/heartbeat --size 960x540 --frames 60\n"
        "\n"
        "Exit codes: 0 written, 2 usage, 7 output failed, 130 interrupted; the frames until then "
        "are "
        "whole.");
    command->callback([&run, arguments, stop] {
        run = [arguments, stop] { return run_render(*arguments, stop); };
    });
    return command;
}

}  // namespace defrec::cli
