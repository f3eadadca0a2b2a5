// Parses the command line, runs the subcommand, and turns whatever happens into an exit code.
#include <CLI/CLI.hpp>
#include <exception>
#include <new>
#include <opencv2/core/utils/logger.hpp>

#include "include/defrec_c.h"
#include "sdk/cli/commands.hpp"
#include "sdk/cli/exit_code.hpp"
#include "sdk/cli/interrupt.hpp"
#include "sdk/cli/render/render_command.hpp"
#include "sdk/cli/terminal.hpp"

namespace defrec::cli {
namespace {

constexpr char kOverview[] =
    "A first run, from nothing to a report:\n"
    "  defrec render --list\n"
    "  defrec render heartbeat --out sequence\n"
    "  defrec track --left sequence/left --right sequence/right --calibration sequence/calibration.yaml \\\n"
    "               --points sequence/points.csv --out result\n"
    "  defrec score result --truth sequence/truth.csv\n"
    "`defrec COMMAND --help` explains each.\n"
    "\n"
    "Exit codes: 0 ok, 1 internal error, 2 usage, 3 input unreadable, 4 calibration invalid, 5 plugin or "
    "device\n"
    "unavailable, 6 finished but below the asked threshold, 7 output failed, 130 interrupted.";

// OpenCV's and FFmpeg's own complaints would stand between ours, which say the same with file and reason.
void silence_decoders() {
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    ::setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);
    ::setenv("OPENCV_VIDEOIO_DEBUG", "0", 0);
}

int guarded(const std::function<int()>& work) {
    try {
        return work();
    } catch (const CliError& error) {
        print_notice(error.what());
        return static_cast<int>(error.code());
    } catch (const std::bad_alloc&) {
        print_notice("out of memory.");
    } catch (const std::exception& error) {
        print_notice(std::string("internal error: ") + error.what());
    }
    return static_cast<int>(ExitCode::kInternal);
}

}  // namespace

int run_program(int argc, const char* const* argv) {
    silence_decoders();
    CLI::App app("defrec: recovers in real time how a tissue surface deforms in stereo video");
    app.name("defrec");
    app.footer(kOverview);
    app.set_version_flag("--version", std::string("defrec ") + defrec_version_string());
    app.require_subcommand(1);
    std::function<int()> run;
    add_track_command(app, run);
    add_render_command(app, run, interrupt_requested);
    add_score_command(app, run);
    add_devices_command(app, run);
    add_bench_command(app, run);
    return guarded([&] {
        try {
            app.parse(argc, argv);
        } catch (const CLI::ParseError& error) {
            return app.exit(error) == 0 ? static_cast<int>(ExitCode::kOk)
                                        : static_cast<int>(ExitCode::kUsage);
        }
        return run();
    });
}

}  // namespace defrec::cli
