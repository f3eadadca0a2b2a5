// `defrec record` on the command line.
#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "sdk/cli/commands/commands.hpp"
#include "sdk/cli/commands/source_options.hpp"
#include "sdk/recording/run_record.hpp"

namespace defrec::cli {
namespace {

constexpr const char* kFooter =
    "DIR gets left/%06d.png, right/%06d.png, times.csv and, last of all, recording.json. `defrec "
    "track --recording DIR` gives the results that the source would have given, to the same bytes. "
    "With --format h264 it gets left.mkv and right.mkv instead, which are lossy: results then "
    "differ from those of the source. Frames of cameras are dropped, and counted, where the disk "
    "or the processor is too slow; "
    "those of recordings wait.\n"
    "\n"
    "Examples:\n"
    "  defrec record --left /dev/video0 --right /dev/video2 --out recording\n"
    "  defrec record --stereo rtsp://192.168.1.20/stereo --layout side-by-side --format pnm --out "
    "recording\n"
    "  defrec track --recording recording --calibration stereo.yaml --out result\n"
    "\n"
    "Exit codes: 0 done, 2 usage, 3 input unreadable or cut short, 7 output failed, 130 "
    "interrupted: Ctrl-C ends the recording of a camera. After 3 and 130 the recording has the "
    "frames until then.";

}  // namespace

CLI::App* add_record_command(CLI::App& app, std::function<int()>& run) {
    constexpr int kMostThreads = 64, kMostMegabytes = 1'000'000;
    auto options = std::make_shared<RecordOptions>();
    CLI::App* command =
        app.add_subcommand("record", "Record both views and their times, without loss or as H.264");
    add_image_options(*command, options->source);
    add_reconnect_option(*command, options->source);
    command->add_option("--out", options->out, "Folder for the recording; created, or empty")
        ->type_name("DIR")
        ->required();
    command
        ->add_option_function<std::string>(
            "--format",
            [options](const std::string& format) {
                options->format = format == "png"   ? RecordFormat::kPng
                                  : format == "pnm" ? RecordFormat::kPnm
                                                    : RecordFormat::kH264;
            },
            "png; pnm: larger files, and hardly any work for the processor; or h264: lossy videos, "
            "a small part of the size; default: png")
        ->type_name("FORMAT")
        ->check(CLI::IsMember({"png", "pnm", "h264"}));
    command
        ->add_option("--queue", options->queue_mb,
                     "Images that may wait in memory for the disk, MB; default: 512")
        ->type_name("MB")
        ->check(CLI::Range(1, kMostMegabytes));
    command
        ->add_option("--threads", options->threads,
                     "Threads that compress images; 0: one for each core")
        ->type_name("N")
        ->check(CLI::Range(0, kMostThreads));
    command->add_flag("--quiet", options->quiet, "Print nothing but errors and lost frames");
    command->add_flag("--json", options->json, "Print recording.json as well");
    command->footer(kFooter);
    command->callback([options, &run] { run = [options] { return run_record(*options); }; });
    return command;
}

}  // namespace defrec::cli
