// Recordings whose first frames show nothing, or little: where the template is taken, what becomes
// of points that were given in the first frame, and the exit code.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>
#include <vector>

#include "sdk/cli/commands/commands.hpp"
#include "sdk/io/csv.hpp"
#include "sdk/scenes/writing/h264_pass.hpp"
#include "sdk/scenes/writing/test_sequence.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;

namespace {

constexpr int kFrames = 10, kSpoilt = 4;

const TestFolder& sequence() { return rendered_sequence<kFrames>(); }

// Its images, of which the first show two times in turns, row by row.
void interlace(const TestFolder& folder) {
    for (const char* view : {"left", "right"}) {
        fs::copy(sequence() / view, folder / view);
        const std::vector<fs::path> files = images_of(folder / view);
        for (std::size_t i = 0; i < kSpoilt; ++i) {
            cv::Mat image = cv::imread(files[i].string(), cv::IMREAD_UNCHANGED);
            const cv::Mat next = cv::imread(files[i + 1].string(), cv::IMREAD_UNCHANGED);
            for (int row = 1; row < image.rows; row += 2) next.row(row).copyTo(image.row(row));
            REQUIRE(cv::imwrite(files[i].string(), image));
        }
    }
}

// Its images, the first of them blurred; sigma in px, 0: black.
void spoil(const TestFolder& folder, double sigma) {
    for (const char* view : {"left", "right"}) {
        fs::copy(sequence() / view, folder / view);
        const std::vector<fs::path> files = images_of(folder / view);
        for (int i = 0; i < kSpoilt; ++i) {
            const std::string file = files[static_cast<std::size_t>(i)].string();
            cv::Mat image = cv::imread(file, cv::IMREAD_UNCHANGED);
            if (sigma == 0)
                image.setTo(0);
            else
                cv::GaussianBlur(image, image, {}, sigma);
            REQUIRE(cv::imwrite(file, image));
        }
    }
}

struct Tracked {
    int code = 0;
    nlohmann::json summary;
    std::size_t rows = 0, lost = 0;
    std::vector<double> errors;  // of rows with a position, sorted, mm
    std::vector<double> shares;  // of the expected error, sorted

    static double percentile(const std::vector<double>& sorted, std::size_t share) {
        REQUIRE_FALSE(sorted.empty());
        return sorted[sorted.size() * share / 100];
    }
    bool says(const std::string& text) const {
        return summary["notes"].dump().find(text) != std::string::npos;
    }
};

// images: a folder with left and right. more: further arguments.
Tracked track(const std::string& images, std::vector<std::string> more) {
    const TestFolder folder;
    const std::string out = folder / "out";
    std::vector<std::string> arguments{"track",
                                       "--quiet",
                                       "--no-overlay",
                                       "--backend",
                                       "cpu",
                                       "--left",
                                       images + "/left",
                                       "--right",
                                       images + "/right",
                                       "--calibration",
                                       sequence() / "calibration.yaml",
                                       "--out",
                                       out};
    arguments.insert(arguments.end(), more.begin(), more.end());
    std::vector<const char*> argv{"defrec"};
    for (const std::string& argument : arguments) argv.push_back(argument.c_str());
    Tracked tracked;
    tracked.code = run_program(static_cast<int>(argv.size()), argv.data());
    if (!fs::exists(out + "/summary.json")) return tracked;
    tracked.summary = nlohmann::json::parse(TestFolder::read(out + "/summary.json"));
    std::map<std::pair<std::int64_t, std::int64_t>, std::array<double, 3>> truth;
    CsvReader true_rows(sequence() / "truth.csv", {"frame", "id", "x", "y", "z"});
    while (true_rows.next())
        truth[{true_rows.integer(0), true_rows.integer(1)}] = {
            true_rows.number(2), true_rows.number(3), true_rows.number(4)};
    CsvReader result(out + "/points.csv",
                     {"frame", "id", "x", "y", "z", "status", "expected_error_mm"});
    while (result.next()) {
        ++tracked.rows;
        if (result.field(5) == "lost") {
            ++tracked.lost;
            continue;
        }
        const auto here = truth.find({result.integer(0), result.integer(1)});
        if (here == truth.end()) continue;
        tracked.errors.push_back(std::hypot(result.number(2) - here->second[0],
                                            result.number(3) - here->second[1],
                                            result.number(4) - here->second[2]));
        tracked.shares.push_back(tracked.errors.back() / result.number(6));
    }
    for (std::vector<double>* sorted : {&tracked.errors, &tracked.shares})
        std::sort(sorted->begin(), sorted->end());
    return tracked;
}

std::string points() { return sequence() / "points.csv"; }

}  // namespace

TEST_CASE("row 150: after black frames the template is a later one's, and a grid lies on it") {
    const TestFolder folder;
    spoil(folder, 0);
    const Tracked tracked = track(folder.path().string(), {});
    CHECK(tracked.code == 0);
    CHECK(tracked.summary["template_frame"] == kSpoilt);
    CHECK(tracked.says("taken from frame 4"));
    CHECK(tracked.summary["points"]["lost_share"].get<double>() < 0.5);
    CHECK(tracked.summary["states"]["lost"] == kSpoilt);
}

TEST_CASE("rows 129 and 151: points of a black frame are lost with a reason, nothing is tracked") {
    const TestFolder folder;
    spoil(folder, 0);
    const Tracked tracked = track(folder.path().string(), {"--points", points()});
    CHECK(tracked.code == 8);
    CHECK(tracked.lost == tracked.rows);
    CHECK(tracked.summary["points"]["of_lost_frames"] == tracked.summary["points"]["count"]);
    CHECK(tracked.says("with --frames N:, or with N in a column frame of the points file"));
    CHECK(tracked.says("in a frame in which the surface was not followed"));
    CHECK(tracked.says("nothing was tracked"));
}

TEST_CASE("rows 129 and 150: points of a blurred frame are where they belong, or lost") {
    for (const double sigma : {2.0, 6.0, 12.0, 25.0}) {
        CAPTURE(sigma);
        const TestFolder folder;
        spoil(folder, sigma);
        const Tracked tracked = track(folder.path().string(), {"--points", points()});
        CHECK(tracked.code == (tracked.errors.empty() ? 8 : 0));
        CHECK(tracked.summary["template_frame"].get<int>() >= kSpoilt);
        CHECK(tracked.summary["template_frame"].get<int>() <= kSpoilt + 3);
        CHECK(tracked.summary["states"]["tracking"].get<int>() >= kFrames - kSpoilt - 1);
        if (tracked.errors.empty()) continue;
        CHECK(Tracked::percentile(tracked.shares, 93) < 2);
        CHECK(Tracked::percentile(tracked.shares, 98) < 3);
    }
}

TEST_CASE("row 129: points of the first of interlaced frames are where they belong, or lost") {
    const TestFolder folder;
    interlace(folder);
    const std::string with_frames = folder / "points.csv";
    std::string text = "id,u,v,frame\n";
    CsvReader given(points(), {"id", "u", "v"});
    while (given.next()) {
        for (const std::size_t field : {0, 1, 2}) text.append(given.field(field)).append(",");
        text.append("0\n");
    }
    folder.write("points.csv", text);
    for (const std::string& file : {points(), with_frames}) {
        const Tracked tracked = track(folder.path().string(), {"--points", file});
        if (tracked.errors.empty()) continue;
        CHECK(Tracked::percentile(tracked.errors, 50) < 0.5);
        CHECK(Tracked::percentile(tracked.shares, 93) < 2);
        CHECK(Tracked::percentile(tracked.shares, 98) < 3);
    }
}

TEST_CASE("row 152: a recording of black frames is not done") {
    const TestFolder folder;
    spoil(folder, 0);
    const Tracked tracked = track(folder.path().string(), {"--frames", ":3"});
    CHECK(tracked.code == 8);
    CHECK(tracked.summary["template_frame"].is_null());
    CHECK(tracked.says("No frame could give a template"));
}

TEST_CASE("a template that is given is named by its file, and told where no frame shows it") {
    const TestFolder folder;
    const std::string saved = folder / "tissue.template";
    const Tracked made =
        track(sequence().path().string(), {"--frames", ":2", "--save-template", saved});
    CHECK(made.summary["template_frame"] == 0);
    CHECK(made.summary["template_file"].is_null());
    const Tracked found =
        track(sequence().path().string(), {"--frames", ":2", "--from-template", saved});
    CHECK(found.summary["template_frame"].is_null());
    CHECK(found.summary["template_file"] == saved);
    CHECK_FALSE(found.says("was found in no frame"));
    spoil(folder, 0);
    const Tracked unfound =
        track(folder.path().string(), {"--frames", ":2", "--from-template", saved});
    CHECK(unfound.code == 8);
    CHECK(unfound.says("was found in no frame: it may be of other tissue, of another recording"));
}

TEST_CASE("targets in metres are followed, and a note tells where they lie") {
    const TestFolder folder;
    const std::string targets =
        folder.write("targets.csv", "id,x,y,z\n1,0,0,0.09\n2,0.004,0.002,0.1\n");
    const Tracked tracked =
        track(sequence().path().string(), {"--frames", ":2", "--targets", targets});
    CHECK(
        tracked.says("2 of 2 targets lie more than 20 mm in front of the whole surface (ids 1 "
                     "and 2). They may be in metres"));
}

TEST_CASE("one view given as both is named as the cause") {
    const TestFolder folder;
    for (const char* view : {"left", "right"}) fs::copy(sequence() / "left", folder / view);
    const Tracked tracked = track(folder.path().string(), {});
    CHECK(tracked.code == 8);
    CHECK(tracked.says("Left and right are the same images."));
    CHECK(tracked.says("No frame could give a template; nothing was tracked. defrec doctor"));
    for (const auto& doubtful : tracked.summary["doubtful"])
        CHECK(doubtful["reason"] != "no-depth");
}

TEST_CASE("the view that is black, or stands still alone, is named with what to do") {
    constexpr std::size_t kFrom = 5;
    for (const bool is_black : {false, true}) {
        const TestFolder folder;
        for (const char* view : {"left", "right"}) fs::copy(sequence() / view, folder / view);
        const std::vector<fs::path> right = images_of(folder / "right");
        for (std::size_t i = kFrom; i < right.size(); ++i) {
            cv::Mat image = cv::imread(right[kFrom - 1].string());
            if (is_black) image.setTo(0);
            REQUIRE(cv::imwrite(right[i].string(), image));
        }
        const Tracked tracked = track(folder.path().string(), {});
        REQUIRE_FALSE(tracked.summary["doubtful"].empty());
        const auto text = tracked.summary["doubtful"][0]["text"].get<std::string>();
        const char* said = is_black ? "the right picture is black; check lens, cable and input"
                                    : "the right picture stands still; check that video input";
        CHECK_MESSAGE(text.find(said) != std::string::npos, text);
        CHECK_FALSE(tracked.says("view_lag_frames"));
        CHECK_FALSE(tracked.says("synchronise"));
    }
}

TEST_CASE("row 161: a strongly compressed video is told, one that is not is not") {
    CHECK_FALSE(track(sequence().path().string(), {}).says("compressed"));
    const TestFolder folder;
    for (const char* view : {"left", "right"}) {
        fs::create_directory(folder / view);
        const std::vector<fs::path> files = images_of(sequence() / view);
        H264Pass pass(folder.path() / "view.mp4", cv::imread(files.front().string()).size(), 0.25);
        for (const fs::path& file : files) pass.write(cv::imread(file.string()));
        pass.end_writing();
        for (const fs::path& file : files)
            REQUIRE(cv::imwrite((folder.path() / view / file.filename()).string(), pass.read()));
    }
    CHECK(track(folder.path().string(), {}).says("compressed"));
}

TEST_CASE("all frames are followed from the template of --template-frame, back to the first") {
    const Tracked first = track(sequence().path().string(), {"--points", points()});
    const Tracked later =
        track(sequence().path().string(), {"--points", points(), "--template-frame", "6"});
    CHECK(later.code == 0);
    CHECK(later.summary["template_frame"] == 6);
    CHECK(later.rows == first.rows);
    CHECK(Tracked::percentile(later.errors, 50) < Tracked::percentile(first.errors, 50) + 0.1);
    CHECK(Tracked::percentile(later.errors, 95) < Tracked::percentile(first.errors, 95) + 0.3);

    const TestFolder folder;
    spoil(folder, 0);
    CHECK(track(folder.path().string(), {"--template-frame", "2"}).code == 3);
    CHECK(track(folder.path().string(), {"--template-frame", "200"}).code == 3);
    CHECK(track(folder.path().string(), {"--template-frame", "-1"}).code == 2);
}

TEST_CASE("row 151: points without a frame are of the first frame of --frames, which is said") {
    const TestFolder folder;
    const std::string with_frames =
        folder.write("points.csv", "id,u,v,frame\n1,160,120,0\n2,160,120,2\n3,160,120,\n");
    const Tracked tracked =
        track(sequence().path().string(), {"--points", with_frames, "--frames", "2:"});
    CHECK(tracked.code == 0);
    CHECK(tracked.says("taken to be pixels of frame 2"));
    CHECK(tracked.says("1 of 3 points to follow were given in a frame in which the surface"));
    CHECK(tracked.lost == kFrames - 2);  // of point 1, which was given before
}
