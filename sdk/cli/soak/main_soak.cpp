// The program `defrec-soak`, which scripts/soak.sh runs.
#include <CLI/CLI.hpp>

#include "sdk/cli/commands/command_line.hpp"
#include "sdk/cli/commands/command_options.hpp"
#include "sdk/cli/soak/soak.hpp"
#include "sdk/io/interrupt.hpp"

int main(int argc, char** argv) {
    using namespace defrec::cli;
    install_signal_handlers();
    SoakOptions options;
    options.bench.width = 320;
    options.bench.height = 240;
    options.bench.threads = 2;
    options.bench.quiet = true;
    CLI::App app("defrec-soak: plays video for long, with all that a day of use brings; CSV");
    app.name("defrec-soak");
    add_device_options(app, options.bench.backend, options.bench.device, options.bench.threads);
    app.add_option("--scene", options.bench.scene, "That is rendered")->capture_default_str();
    app.add_option("--width", options.bench.width, "Of the rendered scene")
        ->check(CLI::Range(64, 8192))
        ->capture_default_str();
    app.add_option("--height", options.bench.height, "Of the rendered scene")
        ->check(CLI::Range(48, 8192))
        ->capture_default_str();
    app.add_option("--minutes", options.minutes, "How long")->check(CLI::Range(0.001, 1e6));
    app.add_option("--speed", options.speed, "Of the video; 1: real time, 0: without a pause")
        ->check(CLI::Range(0.0, 1000.0))
        ->capture_default_str();
    app.add_option("--interval", options.interval_s, "Between two lines, seconds")
        ->check(CLI::Range(0.01, 3600.0))
        ->capture_default_str();
    app.add_option("--players", options.players, "Threads that make a new tracker every few frames")
        ->check(CLI::Range(0, 64))
        ->capture_default_str();
    app.add_option("--trackers-per-second", options.trackers_per_s,
                   "Trackers made and destroyed beside that, without a frame")
        ->check(CLI::Range(0.0, 10000.0))
        ->capture_default_str();
    app.add_flag("--grow", options.grows, "Let templates grow");
    app.add_option("--losing-plugin", options.losing_plugin,
                   "Manifest of a plugin that loses its device in the first run of a stage; one is "
                   "lost each second")
        ->check(CLI::ExistingFile);
    return carry_out(
        app,
        [&options] {
            soak(options);
            return static_cast<int>(ExitCode::kOk);
        },
        argc, argv);
}
