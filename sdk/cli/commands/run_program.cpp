// The program `defrec`: its subcommands.
#include <CLI/CLI.hpp>
#include <memory>
#include <opencv2/core/utils/logger.hpp>

#include "sdk/cli/bench/bench.hpp"
#include "sdk/cli/commands/command_line.hpp"
#include "sdk/cli/commands/commands.hpp"
#include "sdk/cli/commands/help_text.hpp"
#include "sdk/cli/commands/track_like.hpp"
#include "sdk/io/interrupt.hpp"
#include "sdk/io/terminal.hpp"
#include "sdk/scenes/writing/render_command.hpp"

namespace defrec::cli {
namespace {

constexpr char kOverview[] =
    "A first run, from nothing to a report: defrec demo, or step by step:\n"
    "  defrec render --list\n"
    "  defrec render heartbeat --out sequence\n"
    "  defrec track --left sequence/left --right sequence/right --calibration "
    "sequence/calibration.yaml \\\n"
    "               --points sequence/points.csv --out result\n"
    "  defrec score result --truth sequence/truth.csv\n"
    "`defrec COMMAND --help` explains each.\n"
    "\n"
    "Exit codes: 0 ok, 1 internal error or out of memory, 2 usage, 3 input unreadable, 4 "
    "calibration invalid, 5 plugin or device unavailable, 6 finished but below the asked "
    "threshold, 7 output failed, 8 nothing tracked, 9 `defrec doctor` found something, `defrec "
    "register` has no registration, `defrec handeye` no transform, `defrec calibrate` refuses what "
    "it "
    "computed, 130 interrupted.";

// OpenCV's and FFmpeg's own complaints would stand between ours, which say the same with file and
// reason.
void silence_decoders() {
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    ::setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
    ::setenv("OPENCV_VIDEOIO_DEBUG", "0", 0);
    // Nor do they open files that a container names.
    ::setenv("OPENCV_FFMPEG_CAPTURE_OPTIONS", "protocol_whitelist;file", 0);
}

// Frames of the user's own for bench.
BenchSequence load_frames(const std::string& left, const std::string& right,
                          const std::string& calibration, LengthUnit units) {
    constexpr int kMaxFrames = 200;
    SourceOptions options;
    options.left = left;
    options.right = right;
    options.range.last = kMaxFrames;
    FrameSource source(options);
    BenchSequence sequence{left, load_calibration(calibration, units), {}};
    fit_to_frames(sequence.calibration, source.width(), source.height());
    StereoFrame frame;
    while (source.next(frame)) sequence.frames.push_back(frame);
    if (!source.fault().empty()) throw CliError(ExitCode::kInput, source.fault());
    return sequence;
}

}  // namespace

void add_commands(CLI::App& app, std::function<int()>& run) {
    app.description("defrec: recovers in real time how a tissue surface deforms in stereo video");
    app.name("defrec");
    app.formatter(std::make_shared<HelpText>(help_width()));
    app.footer(kOverview);
    app.set_version_flag("--version", std::string("defrec ") + defrec_version_string());
    app.require_subcommand(1);
    add_track_command(app, run);
    add_record_command(app, run);
    add_doctor_command(app, run);
    add_render_command(app, run, interrupt_requested);
    add_register_command(app, run);
    add_calibrate_command(app, run);
    add_hand_eye_command(app, run);
    add_score_command(app, run);
    add_evaluate_command(app, run);
    add_devices_command(app, run);
    add_bench_command(app, run, load_frames);
    add_demo_command(app, run);
    add_completion_command(app, run);
    for (CLI::App* command : app.get_subcommands({}))
        for (CLI::Option* option : command->get_options())
            if (option->get_expected_max() == 0) option->disable_flag_override();
}

int run_program(int argc, const char* const* argv) {
    silence_decoders();
    CLI::App app;
    std::function<int()> run;
    add_commands(app, run);
    try {
        const Arguments arguments = with_recorded_options(app, {argv, argv + argc});
        return carry_out(app, run, arguments.count(), arguments.values());
    } catch (const CliError& error) {
        print_notice(error.what());
        return static_cast<int>(error.code());
    }
}

}  // namespace defrec::cli
