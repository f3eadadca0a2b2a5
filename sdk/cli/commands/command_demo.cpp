// `defrec demo`: from nothing to a report, by the commands that it prints.
#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <memory>

#include "sdk/cli/commands/browser.hpp"
#include "sdk/cli/commands/commands.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/terminal.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFooter =
    "It renders a scene with known truth, tracks it, compares with the truth, and opens the report "
    "in a browser where one is found. The same commands with your own recording are the next "
    "step.";

struct DemoOptions {
    std::string folder = "defrec-demo";
    bool is_opened = true;
};

// The command as it would be typed, and its exit code.
int carry_out_step(const std::vector<std::string>& arguments) {
    std::string typed = "\n$ defrec";
    std::vector<const char*> argv{"defrec"};
    for (const std::string& argument : arguments) {
        typed += " " + argument;
        argv.push_back(argument.c_str());
    }
    print(typed + "\n");
    return run_program(static_cast<int>(argv.size()), argv.data());
}

std::string why_not_opened(Opened opened) {
    switch (opened) {
        case Opened::kYes:
            return {};
        case Opened::kNoScreen:
            return "There is no screen here to open it on; any browser opens that file.\n";
        case Opened::kNoBrowser:
            return "No browser was found on this computer to open it in; any browser opens that "
                   "file.\n";
    }
    return {};
}

int run_demo(const DemoOptions& options) {
    const auto start = std::chrono::steady_clock::now();
    const fs::path folder = options.folder, sequence = folder / "sequence",
                   result = folder / "result";
    const std::vector<std::string> steps[] = {
        {"render", "heartbeat", "--size", "640x360", "--frames", "30", "--out", sequence.string()},
        {"track", "--left", (sequence / "left").string(), "--right", (sequence / "right").string(),
         "--calibration", (sequence / "calibration.yaml").string(), "--points",
         (sequence / "points.csv").string(), "--out", result.string()},
        {"score", result.string(), "--truth", (sequence / "truth.csv").string(), "--brief"}};
    for (const auto& step : steps)
        if (const int code = carry_out_step(step); code != 0) return code;
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const fs::path report = fs::absolute(result / "report.html");
    print("\nDone in " + format_fixed(seconds, 0) + " s. The report: " + report.string() + "\n");
    if (options.is_opened) print(why_not_opened(open_in_browser(report)));
    return static_cast<int>(ExitCode::kOk);
}

}  // namespace

CLI::App* add_demo_command(CLI::App& app, std::function<int()>& run) {
    auto options = std::make_shared<DemoOptions>();
    CLI::App* command = app.add_subcommand("demo",
                                           "Render a scene, track it, score it and open the report "
                                           "in a browser, if there is one; under a minute");
    command->add_option("--out", options->folder, "Folder to write to; created where absent")
        ->type_name("DIR")
        ->capture_default_str();
    command->add_flag("!--no-open", options->is_opened, "Do not open the report in a browser");
    command->footer(kFooter);
    command->callback([options, &run] { run = [options] { return run_demo(*options); }; });
    return command;
}

}  // namespace defrec::cli
