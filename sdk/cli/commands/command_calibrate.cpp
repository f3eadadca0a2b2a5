// `defrec calibrate` on the command line.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "sdk/calibration/run_calibrate.hpp"
#include "sdk/cli/commands/commands.hpp"
#include "sdk/cli/commands/source_options.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr const char* kFooter =
    "Examples:\n"
    "  defrec calibrate --left left.mp4 --right right.mp4 --squares 10x7 --square 3 --out "
    "calibration.yaml\n"
    "  defrec calibrate --left left/ --right right/ --board charuco --squares 12x9 --square 3 \\\n"
    "                   --marker 2.2 --dictionary 4x4_50 --out calibration.yaml\n"
    "\n"
    "Exit codes: 0 written, 2 usage, 3 input unreadable or no board in it, 4 too few pairs, 7 "
    "output failed,\n"
    "9 refused: the calibration must not be used, 130 interrupted.";

// "10x7"
std::string read_squares(const std::string& text, BoardDescription& board) {
    constexpr int kMost = 100;
    const std::vector<std::string_view> parts = split(text, 'x');
    const auto across = parse_integer(parts.front()), down = parse_integer(parts.back());
    if (parts.size() != 2 || !across || !down || *across < 1 || *down < 1 ||
        std::max(*across, *down) > kMost)
        return "'" + printable(text) + "' is no number of squares across and down, such as 10x7";
    board.across = static_cast<int>(*across);
    board.down = static_cast<int>(*down);
    return {};
}

void add_board(CLI::App& command, BoardDescription& board) {
    constexpr double kLeast = 0.01, kMost = 1000;
    command
        .add_option_function<std::string>(
            "--board",
            [&board](const std::string& name) {
                board.kind = name == "charuco" ? BoardKind::kCharuco : BoardKind::kChessboard;
            },
            "chessboard or charuco; default: chessboard")
        ->type_name("KIND")
        ->check(CLI::IsMember({"chessboard", "charuco"}));
    command
        .add_option_function<std::string>(
            "--squares",
            [&board](const std::string& text) {
                const std::string fault = read_squares(text, board);
                if (!fault.empty()) throw CLI::ValidationError("--squares", fault);
            },
            "Squares of the board across and down, counted as squares and not as corners: 10x7")
        ->type_name("AxB")
        ->required();
    command.add_option("--square", board.square_mm, "Side of a square as measured, mm")
        ->type_name("MM")
        ->check(number_in(kLeast, kMost))
        ->required();
    command.add_option("--marker", board.marker_mm, "Side of a marker of a ChArUco board, mm")
        ->type_name("MM")
        ->check(number_in(kLeast, kMost));
    command
        .add_option("--dictionary", board.dictionary,
                    "Dictionary of a ChArUco board's markers; default: 4x4_50")
        ->type_name("NAME")
        ->check(CLI::IsMember(marker_dictionaries()));
}

}  // namespace

CLI::App* add_calibrate_command(CLI::App& app, std::function<int()>& run) {
    constexpr double kLeast = 1, kMost = 100000;
    auto options = std::make_shared<CalibrateCommand>();
    CLI::App* command = app.add_subcommand(
        "calibrate", "Calibrate the two cameras from images of a chessboard or ChArUco board");
    add_source_options(*command, options->source);
    add_board(*command, options->board);
    command
        ->add_option("--coefficients", options->coefficients,
                     "Coefficients of each lens's distortion: 0, 4, 5 or 8; default: 5")
        ->type_name("N")
        ->check(CLI::IsMember({0, 4, 5, 8}));
    command
        ->add_option("--distance", options->distance_mm,
                     "Where errors in mm are said, mm; default: the boards' median distance")
        ->type_name("MM")
        ->check(number_in(kLeast, kMost));
    command->add_option("--out", options->out, "File for the calibration, which `track` reads")
        ->type_name("F")
        ->required();
    command->add_option("--report", options->report, "File for what was found, as JSON")
        ->type_name("F");
    command->add_flag("--json", options->json, "Print what was found as JSON");
    command->add_flag("--quiet", options->quiet, "Print nothing but errors");
    command->footer(kFooter);
    command->callback([options, &run] { run = [options] { return run_calibrate(*options); }; });
    return command;
}

}  // namespace defrec::cli
