// Words that are typed and printed: help, suggestions, completion, options of an earlier run.
#include <doctest/doctest.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "sdk/cli/commands/commands.hpp"
#include "sdk/cli/commands/help_text.hpp"
#include "sdk/cli/commands/suggestion.hpp"
#include "sdk/cli/commands/track_like.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"
#include "sdk/scenes/writing/render_command.hpp"

using namespace defrec::cli;

namespace {

// The program's commands, as run_program() has them.
struct Program {
    CLI::App app{"a program"};
    std::function<int()> run;
    explicit Program(std::size_t width = 80) {
        app.name("defrec");
        app.formatter(std::make_shared<HelpText>(width));
        add_track_command(app, run);
        add_score_command(app, run);
        add_devices_command(app, run);
        add_demo_command(app, run);
        add_completion_command(app, run);
    }
    std::string help(const char* command) { return app.get_subcommand(command)->help(); }
    std::string misspelled(std::vector<const char*> words) {
        words.insert(words.begin(), "defrec");
        return misspelling(app, static_cast<int>(words.size()), words.data());
    }
};

std::vector<std::string> words_of(const Arguments& arguments) {
    return {arguments.values(), arguments.values() + arguments.count()};
}

std::vector<std::string> expanded(const std::vector<std::string>& words) {
    return words_of(with_recorded_options(Program().app, words));
}

}  // namespace

TEST_CASE("help keeps to its width, whole words, and says ranges and defaults in words") {
    for (const std::size_t width : {50u, 80u, 110u}) {
        CAPTURE(width);
        Program program(width);
        for (const char* command : {"track", "score", "devices", "demo"}) {
            std::istringstream lines(program.help(command));
            for (std::string line; std::getline(lines, line);) {
                CAPTURE(line);
                // Examples are lines to copy, and a name may be long.
                const bool is_example = line.find("defrec ") != std::string::npos;
                CHECK((line.size() <= width || is_example));
            }
        }
    }
    const std::string help = Program(80).help("track");
    CHECK(help.find("FLOAT") == std::string::npos);
    CHECK(help.find("1e") == std::string::npos);
    CHECK(help.find("Needs:") == std::string::npos);
    CHECK(help.find("{false}") == std::string::npos);
    CHECK(help.find("(0.001 to 10000)") != std::string::npos);
    CHECK(help.find("--deadline MS") != std::string::npos);
    CHECK(help.find("default: auto") != std::string::npos);
    CHECK(help.find("required") != std::string::npos);
    CHECK(wrapped("one two three", 7, 2) == "one\n  two\n  three");
    CHECK(wrapped_paragraphs("a b\nc\n\n  as it is\nd", 20) == "a b c\n\n  as it is\nd\n");
}

TEST_CASE("the help of commands that fail by a result has their exit codes") {
    CLI::App app{"a program"};
    std::function<int()> run;
    add_score_command(app, run);
    add_evaluate_command(app, run);
    add_bench_command(app, run, {});
    add_render_command(app, run, {});
    for (const CLI::App* command : app.get_subcommands({})) {
        CAPTURE(command->get_name());
        CHECK(command->get_footer().find("\n\nExit codes: 0 ") != std::string::npos);
    }
}

TEST_CASE("a command or an option that does not exist is answered with the one that was meant") {
    Program program;
    CHECK(program.misspelled({"trak"}).find("no command 'trak'. Did you mean track?") !=
          std::string::npos);
    CHECK(program.misspelled({"track", "--lef", "x"}).find("Did you mean --left?") !=
          std::string::npos);
    CHECK(program.misspelled({"track", "--seeed=4"}).find("'--seeed'. Did you mean --seed?") !=
          std::string::npos);
    CHECK(program.misspelled({"track", "--calib", "x"}).find("Did you mean --calibration?") !=
          std::string::npos);
    const std::string far = program.misspelled({"qqqqqqqqqqqqqqqq"});
    CHECK(far.find("Did you mean") == std::string::npos);
    CHECK(far.find("defrec --help lists all") != std::string::npos);
    CHECK(program.misspelled({"track", "mine.mp4"}).find("'mine.mp4' stands without") !=
          std::string::npos);
    CHECK(program.misspelled({"score", "folder"}).empty());
    CHECK(program.misspelled({}).empty());
    CHECK(program.misspelled({"--version"}).empty());
    CHECK(program.misspelled({"track", "--left", "l", "--right=r", "--help", "-h"}).empty());
}

TEST_CASE("what a command line lacks is said whole: the commands, or options and an example") {
    const auto missing = [](std::vector<const char*> words) {
        Program program;
        program.app.require_subcommand(1);
        words.insert(words.begin(), "defrec");
        const int count = static_cast<int>(words.size());
        try {
            program.app.parse(count, words.data());
        } catch (const CLI::RequiredError&) {
            return what_is_missing(program.app, count, words.data());
        }
        return std::string("nothing");
    };
    const std::string commands = missing({});
    CHECK(commands.find("a command is missing. There are:\n  track ") == 0);
    CHECK(commands.find("\n  demo ") != std::string::npos);
    CHECK(commands.find("\ndefrec COMMAND --help explains each.") != std::string::npos);
    CHECK(missing({"track"}) ==
          "track needs --calibration F and --out DIR, as in\n  defrec track --left left.mp4 "
          "--right right.mp4 --calibration stereo.yaml --out result\ndefrec track --help lists "
          "all.");
    CHECK(missing({"track", "--out", "x"}).find("needs --calibration F, as in") !=
          std::string::npos);
    CHECK(missing({"score"}).find("score needs DIR, as in\n  defrec score result --truth") == 0);
    CHECK(missing({"completion"})
              .find("completion needs SHELL, as in\n  defrec completion bash > ") == 0);
    CHECK(missing({"devices"}) == "nothing");
}

TEST_CASE("score says of a plan's run that plans are not scored") {
    const TestFolder folder;
    folder.write("plan.csv", "");
    const std::string truth = folder.write("truth_deep.csv", "frame,id,depth,x,y,z\n");
    const auto refusal = [&] {
        Program program;
        const std::string out = folder.path().string();
        const std::vector<const char*> words{"defrec", "score", out.c_str(), "--truth-deep",
                                             truth.c_str()};
        program.app.parse(static_cast<int>(words.size()), words.data());
        return refusal_of([&] { program.run(); });
    };
    CHECK_SAYS(refusal(), "plans are not scored");
    folder.write("targets.csv", "frame,id,depth,x,y,z,status,expected_error_mm\n");
    CHECK(refusal().find("plans are not scored") == std::string::npos);
}

TEST_CASE("options of a summary stand before those that are given, which count") {
    const TestFolder folder;
    const std::string summary = folder.write("summary.json", R"({
        "folder": "/data/first",
        "options": {"left": "left", "right": "/other/right", "calibration": "l.yaml,r.yaml",
                    "grow": true, "meshes": false, "seed": "7", "fps": null, "out": "result",
                    "view": "8000", "trace": "t.json", "device": "cpu", "backend": null}})");
    const std::vector<std::string> words =
        expanded({"defrec", "track", "--like", summary, "--out", "again"});
    CHECK(words == std::vector<std::string>{
                       "defrec", "track", "--calibration", "/data/first/l.yaml,/data/first/r.yaml",
                       "--device", "cpu", "--grow", "--left", "/data/first/left", "--right",
                       "/other/right", "--seed", "7", "--like", summary, "--out", "again"});
    const std::vector<std::string> other =
        expanded({"defrec", "track", "--like=" + summary, "--stereo", "s.mp4", "--layout",
                  "top-bottom", "--backend", "reference", "--seed=3"});
    for (const char* gone : {"--left", "--right", "--device"})
        CHECK(std::find(other.begin(), other.end(), gone) == other.end());
    CHECK(std::count(other.begin(), other.end(), "--seed") == 0);
    const std::vector<std::string> bag =
        expanded({"defrec", "track", "--like", summary, "--bag", "b.mcap"});
    for (const char* gone : {"--left", "--right"})
        CHECK(std::count(bag.begin(), bag.end(), gone) == 0);
    CHECK(expanded({"defrec", "track", "--out", "x"}).size() == 4);
    CHECK(expanded({"defrec", "score", "--like", summary}).size() == 4);
}

TEST_CASE("a bag of a summary is found from anywhere, and its topics go with it") {
    const TestFolder folder;
    const std::string summary = folder.write("summary.json", R"({
        "folder": "/data/first",
        "options": {"bag": "b.mcap", "stereo-topic": "/both", "layout": "top-bottom",
                    "disparity": "network", "stereo": null}})");
    const std::vector<std::string> kept{"--disparity", "/data/first/network", "--layout",
                                        "top-bottom",  "--stereo-topic",      "/both"};
    const auto given = [&](std::vector<std::string> words) {
        words.insert(words.begin(), {"defrec", "track", "--like", summary});
        const std::vector<std::string> all = expanded(words);
        return std::vector<std::string>(all.begin() + 2,
                                        all.end() - static_cast<std::ptrdiff_t>(words.size() - 2));
    };
    std::vector<std::string> first{"--bag", "/data/first/b.mcap"};
    first.insert(first.end(), kept.begin(), kept.end());
    CHECK(given({}) == first);
    CHECK(given({"--bag", "other.mcap"}) == kept);
    const std::vector<std::string> disparity(kept.begin(), kept.begin() + 2);
    CHECK(given({"--left", "l", "--right", "r"}) == disparity);
    CHECK(given({"--recording", "r"}) == disparity);
    const std::vector<std::string> stereo(kept.begin(), kept.begin() + 4);
    CHECK(given({"--stereo", "s.mp4"}) == stereo);
    const std::string video = folder.write("video.json", R"({
        "folder": "/data", "options": {"stereo": "s.mp4", "layout": "top-bottom", "fps": "25"}})");
    CHECK(expanded({"defrec", "track", "--like", video, "--bag", "b.mcap"}).size() == 6);
}

TEST_CASE("a comma in a name divides it only where it is one of two calibrations") {
    const TestFolder folder;
    folder.write("rig, old.yaml", "");
    const auto given = [&](const char* options) {
        const std::string summary =
            folder.write("summary.json", R"({"folder": ")" + folder.path().string() +
                                             R"(", "options": )" + options + "}");
        const std::vector<std::string> all = expanded({"defrec", "track", "--like", summary});
        return std::vector<std::string>(all.begin() + 2, all.end() - 2);
    };
    CHECK(
        given(R"({"left": "Smith, J/left.mp4", "plan": "a,b"})") ==
        std::vector<std::string>{"--left", folder / "Smith, J/left.mp4", "--plan", folder / "a,b"});
    CHECK(given(R"({"calibration": "rig, old.yaml"})") ==
          std::vector<std::string>{"--calibration", folder / "rig, old.yaml"});
    CHECK(given(R"({"calibration": "l.yaml,r.yaml"})") ==
          std::vector<std::string>{"--calibration", (folder / "l.yaml,") + (folder / "r.yaml")});
}

TEST_CASE("a summary of somebody else gives no option that is not repeated, and runs nothing") {
    const TestFolder folder;
    const auto refused = [&](const std::string& options, ExitCode code = ExitCode::kInput,
                             std::vector<std::string> beside = {}) {
        beside.insert(beside.begin(), {"defrec", "track", "--like"});
        beside.insert(
            beside.begin() + 3,
            folder.write("summary.json", R"({"folder": "/data", "options": )" + options + "}"));
        return refusal_of([&] { expanded(beside); }, code);
    };
    CHECK_SAYS(refused(R"({"save-template=/home/u/x": true})"),
               R"(its option "save-template=/home/u/x" is none as `defrec track` records them)");
    for (const char* options :
         {R"({"seed=3 --out": "x"})", R"({"help": true})", R"({"-save": "x"})", R"({"seed": true})",
          R"({"grow": "x"})", R"({"seed": 7})", R"({"left": ["a"]})"})
        CHECK_SAYS(refused(options), "is none as `defrec track` records");
    CHECK(refused(R"({"of_another_version": null, "flag": false, "out": "x", "like": "y"})") ==
          "accepted");
    for (const char* source : {"left", "right", "stereo"}) {
        const std::string options = std::string("{\"") + source + R"(": "gst:filesink"})";
        CHECK_SAYS(refused(options, ExitCode::kUsage), "give it beside --like");
        CHECK(refused(options, ExitCode::kUsage, {std::string("--") + source, "gst:fakesrc"}) ==
              "accepted");
    }
    // What follows an option is its value, whatever it looks like.
    Program program;
    const Arguments arguments = with_recorded_options(
        program.app,
        {"defrec", "track", "--like",
         folder.write("value.json",
                      R"({"folder": "/data", "options": {"frames": "--save-template=x"}})")});
    CHECK_SAYS(refusal_of([&] { program.app.parse(arguments.count(), arguments.values()); },
                          ExitCode::kUsage),
               "--frames: '--save-template=x' is not of the form");
    const std::string relative = folder.write(
        "relative.json", R"({"folder": "gst:filesink location=x", "options": {"left": "y"}})");
    CHECK_SAYS(refusal_of([&] {
                   expanded({"defrec", "track", "--like", relative});
               }),
               "this is no summary.json");
}

TEST_CASE("a camera's password is in no options that are kept, and its address is given again") {
    Program program;
    CLI::App& track = *program.app.get_subcommand("track");
    std::vector<const char*> words{
        "defrec",   "track",     "--stereo",      "rtsp://u:secret@host/a",
        "--out",    "result",    "--calibration", "c.yaml",
        "--layout", "top-bottom"};
    program.app.parse(static_cast<int>(words.size()), words.data());
    std::string stereo;
    for (const RecordedOption& option : recorded_options(track))
        if (option.name == "stereo") stereo = option.value.value();
    CHECK(stereo == "rtsp://***@host/a");

    const TestFolder folder;
    const std::string summary = folder.write(
        "summary.json", R"({"folder": "/data", "options": {"stereo": ")" + stereo + R"("}})");
    CHECK(expanded({"defrec", "track", "--like", summary, "--quiet"}) ==
          std::vector<std::string>{"defrec", "track", "--stereo", "rtsp://host/a", "--like",
                                   summary, "--quiet"});
}

TEST_CASE("what is no summary with options is refused") {
    const TestFolder folder;
    for (const char* text :
         {"", "[]", "{}", R"({"options": {}})", R"({"options": 1, "folder": "/"})",
          R"({"options": {}, "folder": ""})"})
        CHECK_SAYS(refusal_of([&] {
                       expanded({"defrec", "track", "--like", folder.write("s.json", text)});
                   }),
                   "s.json: this is no summary.json");
    CHECK_SAYS(refusal_of([&] {
                   expanded({"defrec", "track", "--like", folder / "none"});
               }),
               "none");
}

TEST_CASE("shells take the completion, and it completes commands, options and values") {
    CHECK(std::system("command -v bash >/dev/null 2>&1") == 0);
    const TestFolder folder;
    const std::string script = folder / "completion";
    REQUIRE(std::system((DEFREC_BUILD_DIR "/bin/defrec completion bash > " + script).c_str()) == 0);
    const auto completed = [&](const std::string& words, int at) {
        const std::string command = "bash -c 'source " + script + "; COMP_WORDS=(" + words +
                                    "); COMP_CWORD=" + std::to_string(at) +
                                    "; _defrec; echo ${COMPREPLY[*]}' > " + (folder / "reply");
        REQUIRE(std::system(command.c_str()) == 0);
        return TestFolder::read(folder / "reply");
    };
    CHECK(completed("defrec tr", 1) == "track\n");
    CHECK(completed("defrec track --cal", 2) == "--calibration\n");
    CHECK(completed("defrec track --layout to", 3) == "top-bottom\n");
    CHECK(completed("defrec render heartb", 2) == "heartbeat\n");
    CHECK(completed("defrec track --backend vul", 3) == "vulkan\n");
    CHECK(completed("defrec evaluate --dataset ham", 3) == "hamlyn\n");
    CHECK(completed("defrec track --device /", 3) == "\n");
    CHECK(completed("defrec track --points /us", 3) == "/usr\n");
    CHECK(completed("defrec bench --scene heartb", 3) == "heartbeat\n");
    CHECK(completed("defrec completion z", 2) == "zsh\n");
    CHECK(completed("defrec he", 1) == "help\n");
    CHECK(completed("defrec help tr", 2) == "track\n");
    for (const char* shell : {"zsh", "fish"}) {
        REQUIRE(std::system((DEFREC_BUILD_DIR "/bin/defrec completion " + std::string(shell) +
                             " > " + script)
                                .c_str()) == 0);
        const std::string text = TestFolder::read(script);
        CHECK(text.find("calibration") != std::string::npos);
        CHECK(text.find("heartbeat") != std::string::npos);
        CHECK(text.find("  defrec") == std::string::npos);
        const std::string check = std::string("command -v ") + shell + " >/dev/null 2>&1";
        if (std::system(check.c_str()) == 0)
            CHECK(std::system((std::string(shell) + " -n " + script).c_str()) == 0);
    }
}
