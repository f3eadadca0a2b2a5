// `defrec track` on the command line.
#include <CLI/CLI.hpp>
#include <limits>
#include <memory>

#include "sdk/cli/commands/command_options.hpp"
#include "sdk/cli/commands/commands.hpp"
#include "sdk/cli/commands/source_options.hpp"
#include "sdk/cli/commands/track_like.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/session/track_session.hpp"

namespace defrec::cli {
namespace {

constexpr const char* kFooter =
    "Results in DIR: points.csv (mm in the left rectified camera of each frame), targets.csv "
    "likewise, plan.csv and plan/*.ply of a plan, display.csv with --display-delay, "
    "frames.csv, trajectory.txt (the camera, as TUM has it), summary.json, template.ply, "
    "overlay.mp4 and report.html, which opens in "
    "a browser.\n"
    "\n"
    "OpenIGTLink is neither encrypted nor authenticated: keep it on this computer or in a network "
    "of your own. A receiver that is slow or gone never slows tracking down; it misses frames. Nor "
    "does a browser with --view, whose address holds a token: keep it to yourself.\n"
    "\n"
    "Examples:\n"
    "  defrec track --left left.mp4 --right right.mp4 --calibration stereo.yaml --out result\n"
    "  defrec track --left left/%06d.png --right right/%06d.png --calibration stereo.yaml "
    "--points points.csv --out result\n"
    "  defrec track --stereo both.mp4 --layout top-bottom --calibration left.yaml,right.yaml "
    "--frames 100:200 --out result\n"
    "  defrec track --left left --right right --calibration stereo.yaml --out result "
    "--realtime --igtl "
    "localhost:18944\n"
    "  defrec track --left /dev/video0 --right /dev/video2 --calibration stereo.yaml --out "
    "result --view\n"
    "  defrec track --like result/summary.json --out again\n"
    "\n"
    "Exit codes: 0 done, 2 usage, 3 input unreadable or cut short, 4 calibration invalid, 5 no "
    "device, 7 output failed, 8 nothing tracked, 130 interrupted. After 3 and 130 the results hold "
    "the frames tracked until then.";

void add_input_options(CLI::App& command, TrackOptions& options) {
    add_source_options(command, options.source);
    add_calibration_options(command, options.calibration, options.units);
    command
        .add_option("--points", options.points,
                    "CSV id,u,v: pixels to follow of the first left image that is tracked, or "
                    "with a column frame of that frame's; default: a grid in the template's image")
        ->type_name("F");
    command
        .add_option("--targets", options.targets,
                    "CSV id,x,y,z and depth, if known: targets beneath the surface to follow, mm "
                    "in the left rectified camera of the first frame, or of the template's")
        ->type_name("F");
    command
        .add_option("--plan", options.plan.file,
                    "Plan that `defrec register --plan` or the C API saved: its model and targets "
                    "are followed. It belongs to the template, so give that as --from-template, or "
                    "the recording that it is of")
        ->type_name("F");
    auto* disparity = command.add_option(
        "--disparity", options.source.disparity,
        "Folder with disparity of frames that was measured elsewhere, in place of stage stereo: "
        "of the rectified left image, PFM in px or PNG of 16 bits in 1/256 px, 0 where there is "
        "none. A file is of the frame whose left image has its number, of videos and bags counted "
        "from 0; frames without a file have their disparity measured");
    auto* sigma = command.add_option(
        "--disparity-sigma", options.source.disparity_sigma_px,
        "Standard deviation of that disparity's error, px, of the part that a pixel shares with "
        "those around it; expected errors hold it");
    disparity->type_name("DIR")->needs(sigma);
    sigma->type_name("PX")->check(number_in(0.001, 100.0))->needs(disparity);
    add_reconnect_option(command, options.source);
}

void add_tracking_options(CLI::App& command, TrackOptions& options) {
    add_device_options(command, options.backend, options.device, options.threads);
    command.add_option("--config", options.config, "YAML with parameters of the tracker by name")
        ->type_name("F");
    command
        .add_option("--seed", options.seed,
                    "Seed of the random choices; the same seed gives the same bits")
        ->type_name("S")
        ->check(seed_number());
    add_deadline_option(command, options.deadline_ns);
    command.add_flag("--grow", options.grow, "Let tissue that comes into view join the template");
    command
        .add_option("--from-template", options.surface.load,
                    "Follow the template of this file, which an earlier run saved, instead of one "
                    "of the first frame")
        ->type_name("F");
    command
        .add_option("--template-frame", options.surface.frame,
                    "Take the template of this frame of the recording, counted from 0; default: of "
                    "the first one that shows the tissue well")
        ->type_name("N")
        ->check(CLI::Range(std::int64_t{0}, std::int64_t{1'000'000'000}))
        ->excludes("--from-template");
    command
        .add_option("--save-template", options.surface.save,
                    "Save the template at the end, with all tissue that joined it")
        ->type_name("F");
}

void add_recording_options(CLI::App& command, TrackOptions& options) {
    command.add_flag("--meshes", options.recordings.meshes,
                     "Also write the deformed surface of each frame, deformed/*.ply");
    command
        .add_option("--plan-meshes", options.plan.mesh_every,
                    "Write the plan's mesh of every Nth frame, plan/*.ply; default: 1; 0: of none")
        ->type_name("N")
        ->check(CLI::Range(std::int64_t{0}, std::int64_t{1'000'000'000}))
        ->needs("--plan");
    command
        .add_option("--display-delay", options.display_delay_ms,
                    "Also write where all that is followed is so many ms after its frame, when it "
                    "is shown, display.csv; by OpenIGTLink it is sent instead of what the frame "
                    "had")
        ->type_name("MS")
        ->check(number_in(0.0, double{DEFREC_MAX_PREDICTION_MS}));
    command.add_flag("!--no-overlay", options.recordings.overlay, "Do not write overlay.mp4");
    command.add_flag("--overlay-details", options.recordings.overlay_details,
                     "Draw control points and refused matches too, in overlay and report");
    command
        .add_option("--trace", options.recordings.trace,
                    "Write a timeline of program, device and uploads that Perfetto and "
                    "chrome://tracing open; the host then waits after each stage and frame")
        ->type_name("F");
}

void add_link_options(CLI::App& command, TrackOptions& options) {
    LinkOptions& link = options.link;
    auto* connect = command.add_option_function<std::string>(
        "--igtl",
        [&link](const std::string& text) {
            link.kind = LinkOptions::Kind::kConnect;
            link.endpoint = parse_target(text);
        },
        "Send each frame by OpenIGTLink to the receiver that listens there, such as 3D Slicer at "
        "port 18944");
    connect->type_name("HOST:PORT");
    auto* listen = command.add_option_function<std::string>(
        "--igtl-listen",
        [&link](const std::string& text) {
            link.kind = LinkOptions::Kind::kListen;
            link.endpoint = parse_listener(text);
        },
        "Send each frame by OpenIGTLink to up to 8 receivers that connect; from this computer "
        "only, unless ADDRESS is "
        "given; port 0: any that is free");
    listen->type_name("[ADDRESS:]PORT")->excludes(connect);
    command.add_flag("--igtl-image", options.link_image,
                     "Send the left image with each frame by OpenIGTLink as well");
    command
        .add_option_function<std::string>(
            "--igtl-clock",
            [&link](const std::string& clock) { link.has_system_clock = clock == "system"; },
            "Time stamps of OpenIGTLink: input, 0 at the first frame, or system, the time of day "
            "(UTC) at the first frame and the input's time since; default: input")
        ->type_name("CLOCK")
        ->check(CLI::IsMember({"input", "system"}));
    command
        .add_option_function<std::uint16_t>(
            "--view", [&options](std::uint16_t port) { options.view_port = port; },
            "Show frames as they are tracked on a page for browsers of this computer, and follow "
            "points clicked there; prints its address. PORT 0 or none: any that is free")
        ->type_name("[PORT]")
        ->check(CLI::Range(0, int{std::numeric_limits<std::uint16_t>::max()}))
        ->expected(0, 1)
        ->default_str("0");
    command.add_flag("--realtime", options.realtime,
                     "Take frames no faster than at their own times, as a camera delivers them");
}

}  // namespace

// CLI11's needs() knows no either.
void check_link_options(const TrackOptions& options) {
    if (options.link.kind != LinkOptions::Kind::kNone) return;
    const char* extra = options.link.has_system_clock ? "--igtl-clock"
                        : options.link_image          ? "--igtl-image"
                                                      : nullptr;
    if (extra != nullptr)
        throw CliError(ExitCode::kUsage, std::string(extra) + " needs --igtl or --igtl-listen.");
}

CLI::App* add_track_command(CLI::App& app, std::function<int()>& run) {
    auto options = std::make_shared<TrackOptions>();
    CLI::App* command =
        app.add_subcommand("track", "Recover how the tissue deforms, frame by frame");
    add_input_options(*command, *options);
    command->add_option("--out", options->out, "Folder for the results; created where absent")
        ->type_name("DIR")
        ->required();
    add_tracking_options(*command, *options);
    add_recording_options(*command, *options);
    add_link_options(*command, *options);
    command
        ->add_option_function<std::string>(
            "--like", [](const std::string&) {},
            "Take all options from the summary.json of an earlier run, but for those given here "
            "and for where results go; results are the same with the same defrec and device")
        ->type_name("F");
    command->add_flag("--quiet", options->quiet, "Print nothing but errors");
    command->add_flag("--json", options->json, "Print the summary as JSON");
    command->footer(kFooter);
    command->callback([options, command, &run] {
        check_link_options(*options);
        options->recorded = recorded_options(*command);
        run = [options] { return run_track(*options); };
    });
    return command;
}

}  // namespace defrec::cli
