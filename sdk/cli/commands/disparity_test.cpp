// `defrec track` with disparity of a folder.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "sdk/cli/commands/test_run.hpp"
#include "sdk/client/library.hpp"
#include "sdk/input/frame_source.hpp"
#include "sdk/io/csv.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/scenes/writing/test_sequence.hpp"

using namespace defrec;
using namespace defrec::cli;

namespace {

constexpr int kWidth = 320, kHeight = 240, kFrames = 4;

// A rendered sequence, in stereo/ what stage stereo measures of all frames but the second, and in
// halved/ half of it, of all.
struct Sequence {
    TestFolder folder;

    Sequence() {
        RenderOptions render;
        render.scene = "heartbeat";
        render.out_dir = folder.path().string();
        render.width = kWidth;
        render.height = kHeight;
        render.frames = kFrames;
        render_sequence(render, {});
        std::filesystem::create_directory(folder / "stereo");
        std::filesystem::create_directory(folder / "halved");
        ContextOptions quiet;
        quiet.quiet = true;
        const Context context = open_context(quiet);
        const Device device = choose_device(context, "cpu", "");
        SourceOptions options;
        options.left = folder / "left";
        options.right = folder / "right";
        FrameSource source(options);
        StereoCalibration calibration = load_calibration(folder / "calibration.yaml");
        fit_to_frames(calibration, kWidth, kHeight);
        const Rig rig = make_rig(context, calibration);
        auto desc = initialised<defrec_tracker_desc>();
        desc.device_id = device.id.c_str();
        desc.format = format_of_channels(source.channels());
        desc.keep_disparity = 1;
        desc.body = DEFREC_BODY_OFF;
        defrec_tracker handle = nullptr;
        REQUIRE(defrec_tracker_create(context.get(), rig.get(), &desc, &handle) == DEFREC_OK);
        const Tracker tracker(handle);
        StereoFrame frame;
        while (source.next(frame)) {
            const Job job = submit(tracker, frame);
            const defrec_result result = result_of(job, frame.index);
            if (frame.index != 1) write("stereo", frame.index, result.disparity, 1);
            write("halved", frame.index, result.disparity, 0.5f);
        }
    }

    // From the first good frame on; track(): from the first one.
    int track_from_good(const std::string& out, const std::vector<std::string>& more) const {
        std::vector<std::string> arguments{"track",
                                           "--quiet",
                                           "--no-overlay",
                                           "--backend",
                                           "cpu",
                                           "--left",
                                           folder / "left",
                                           "--right",
                                           folder / "right",
                                           "--calibration",
                                           folder / "calibration.yaml",
                                           "--out",
                                           out};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(arguments);
    }
    int track(const std::string& out, std::vector<std::string> more) const {
        more.insert(more.end(), {"--template-frame", "0"});
        return track_from_good(out, more);
    }

  private:
    void write(const std::string& to, std::int64_t index, const std::int16_t* disparity,
               float factor) const {
        std::string text = "Pf\n320 240\n-1\n";
        for (int y = kHeight - 1; y >= 0; --y)
            for (int x = 0; x < kWidth; ++x) {
                const std::int16_t value = disparity[y * kWidth + x];
                const float px = value == DEFREC_DISPARITY_NONE
                                     ? INFINITY
                                     : factor * static_cast<float>(value) / 16;
                text.append(reinterpret_cast<const char*>(&px), sizeof px);
            }
        folder.write(to + "/" + std::to_string(index) + ".pfm", text);
    }
};

const Sequence& sequence() {
    static const Sequence made;
    return made;
}

// Status of all rows, in their order, and the place of those with one of these statuses.
std::vector<std::string> places(const std::string& out, const std::set<std::string>& statuses) {
    std::vector<std::string> found;
    CsvReader csv(out + "/points.csv", {"frame", "id", "status", "x", "y", "z"});
    while (csv.next()) {
        const std::size_t fields = statuses.contains(std::string(csv.field(2))) ? 6 : 3;
        std::string row;
        for (std::size_t i = 0; i < fields; ++i) row.append(csv.field(i)).append(" ");
        found.push_back(row);
    }
    return found;
}

std::vector<double> errors(const std::string& out) {
    std::vector<double> found;
    CsvReader csv(out + "/points.csv", {"status", "expected_error_mm"});
    while (csv.next())
        if (csv.field(0) != "lost") found.push_back(csv.number(1));
    return found;
}

}  // namespace

TEST_CASE("disparity of a folder tracks as that of stage stereo does, with the stated error") {
    const TestFolder folder;
    const std::string stereo = sequence().folder / "stereo";
    REQUIRE(sequence().track(folder / "measured", {}) == 0);
    REQUIRE(sequence().track(folder / "given",
                             {"--disparity", stereo, "--disparity-sigma", "0.03"}) == 0);
    const std::set<std::string> all{"tracked", "extrapolated"};
    CHECK(places(folder / "given", all) == places(folder / "measured", all));
    REQUIRE(sequence().track(folder / "coarse",
                             {"--disparity", stereo, "--disparity-sigma", "0.5"}) == 0);
    // Tissue that is not seen goes by the expected errors of what is.
    CHECK(places(folder / "coarse", {"tracked"}) == places(folder / "measured", {"tracked"}));
    const std::vector<double> fine = errors(folder / "given"), coarse = errors(folder / "coarse");
    REQUIRE(fine.size() == coarse.size());
    std::size_t larger = 0;
    for (std::size_t i = 0; i < fine.size(); ++i) larger += coarse[i] > 1.2 * fine[i];
    // But for the frame without a file.
    CHECK(larger > fine.size() / 2);
    CHECK(larger < fine.size());

    // The same again, from its summary alone.
    const auto summary = nlohmann::json::parse(TestFolder::read(folder / "coarse/summary.json"));
    CHECK(summary["notes"].dump().find("1 of 4 frames has no file in ") != std::string::npos);
    CHECK(summary["input"]["disparity"] == stereo);
    REQUIRE(run({"track", "--quiet", "--like", folder / "coarse/summary.json", "--out",
                 folder / "again"}) == 0);
    CHECK(TestFolder::read(folder / "again/points.csv") ==
          TestFolder::read(folder / "coarse/points.csv"));
}

TEST_CASE("row 201: a folder with half of the disparity gives no template") {
    const TestFolder folder;
    const std::vector<std::string> halved{"--disparity", sequence().folder / "halved",
                                          "--disparity-sigma", "0.1"};
    CHECK(sequence().track(folder / "none", halved) == 3);
    const std::string out = folder / "out";
    CHECK(sequence().track_from_good(out, halved) == 8);
    const auto summary = nlohmann::json::parse(TestFolder::read(out + "/summary.json"));
    const std::string notes = summary["notes"].dump();
    CHECK(notes.find("the images contradict the disparity of --disparity") != std::string::npos);
}

TEST_CASE("row 202: options and files of disparity that are of no use: exit codes 2 and 3") {
    const TestFolder folder;
    const std::string out = folder / "out", stereo = sequence().folder / "stereo";
    CHECK(sequence().track(out, {"--disparity", stereo}) == 2);
    CHECK(sequence().track(out, {"--disparity-sigma", "0.1"}) == 2);
    for (const char* sigma : {"0", "-1", "nan", "101", "x"})
        CHECK(sequence().track(out, {"--disparity", stereo, "--disparity-sigma", sigma}) == 2);
    CHECK(sequence().track(out, {"--disparity", stereo, "--disparity-sigma", "0.1", "--interlaced",
                                 "top-first"}) == 2);
    CHECK(sequence().track(out, {"--disparity", folder / "absent", "--disparity-sigma", "0.1"}) ==
          3);
    CHECK(sequence().track(
              out, {"--disparity", folder.path().string(), "--disparity-sigma", "0.1"}) == 3);
    folder.write("0.pfm", "Pf\n64 48\n-1\n");
    CHECK(sequence().track(
              out, {"--disparity", folder.path().string(), "--disparity-sigma", "0.1"}) == 3);
    // No output replaces what is read.
    CHECK(sequence().track(out, {"--disparity", stereo, "--disparity-sigma", "0.1",
                                 "--save-template", stereo + "/0.pfm"}) == 2);
}
