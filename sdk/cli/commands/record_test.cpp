// `defrec record`: a recording is tracked to the same bytes as its source, and never looks finished
// where it is not.
#include <doctest/doctest.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <string>
#include <vector>

#include "sdk/cli/commands/test_program.hpp"
#include "sdk/cli/commands/test_run.hpp"
#include "sdk/io/csv.hpp"
#include "sdk/scenes/writing/test_sequence.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;

namespace {

constexpr int kFrames = 5;
using Words = std::vector<std::string>;

const TestFolder& sequence() { return rendered_sequence<kFrames>(); }

Words joined(Words words, const Words& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
}

int track(const Words& source, const std::string& out) {
    return run(joined({"track", "--quiet", "--no-overlay", "--calibration",
                       sequence() / "calibration.yaml", "--out", out},
                      source));
}

int record(const Words& source, const std::string& out) {
    return run(joined({"record", "--quiet", "--out", out}, source));
}

Words images() { return {"--left", sequence() / "left", "--right", sequence() / "right"}; }

nlohmann::json json_of(const std::string& path) {
    return nlohmann::json::parse(TestFolder::read(path));
}

// Tracks the source, and a recording of it, to the same bytes.
void check_replay(const Words& source, const Words& more, const Words& of_recorder = {}) {
    const TestFolder folder;
    REQUIRE(track(joined(source, more), folder / "direct") == 0);
    REQUIRE(record(joined(source, of_recorder), folder / "recording") == 0);
    REQUIRE(track(joined({"--recording", folder / "recording"}, more), folder / "replayed") == 0);
    for (const char* name : {"points.csv", "template.ply", "trajectory.txt"}) {
        CAPTURE(name);
        const std::string bytes = TestFolder::read(folder / "direct/" + name);
        CHECK(bytes.size() > 100);
        CHECK(bytes == TestFolder::read(folder / "replayed/" + name));
    }
    CHECK(json_of(folder / "direct/summary.json")["input"]["fps"] ==
          json_of(folder / "replayed/summary.json")["input"]["fps"]);
}

// Both views as videos of 24000/1001 images a second, which are not without loss.
struct Videos {
    explicit Videos(int right_frames = kFrames) {
        write("left", kFrames);
        write("right", right_frames);
    }
    void write(const char* view, int frames) const {
        cv::VideoWriter video(folder / (std::string(view) + ".avi"), cv::CAP_FFMPEG,
                              cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 24000.0 / 1001,
                              {320, 240});
        const auto files = images_of(sequence() / view);
        for (int i = 0; i < frames; ++i)
            video.write(cv::imread(files[static_cast<std::size_t>(i)].string()));
    }
    Words source() const {
        return {"--left", folder / "left.avi", "--right", folder / "right.avi"};
    }
    TestFolder folder;
};

// 2000 frames, and the program that records them.
struct Long {
    Long() {
        repeat_sequence(sequence(), folder);
        program.emplace(Words{"record", "--quiet", "--left", folder / "left", "--right",
                              folder / "right", "--out", out});
        program->wait_until([&] { return fs::exists(out + "/right/000003.png"); });
    }
    // The exit code; of a signal that ended it the negative number.
    int end(int signal) {
        program->send(signal);
        return program->exit_code();
    }
    TestFolder folder;
    std::string out = folder / "recording";
    std::optional<ChildProgram> program;
};

// For a scope: the address space of this process grows by so much at most.
class MemoryLimit {
  public:
    explicit MemoryLimit(std::uintmax_t bytes) {
        getrlimit(RLIMIT_AS, &before_);
        std::uintmax_t pages = 0;
        std::ifstream("/proc/self/statm") >> pages;
        const rlimit limit{pages * static_cast<std::uintmax_t>(sysconf(_SC_PAGESIZE)) + bytes,
                           before_.rlim_max};
        setrlimit(RLIMIT_AS, &limit);
    }
    ~MemoryLimit() { setrlimit(RLIMIT_AS, &before_); }
    MemoryLimit(const MemoryLimit&) = delete;
    MemoryLimit& operator=(const MemoryLimit&) = delete;

  private:
    rlimit before_{};
};

}  // namespace

TEST_CASE("a recording of images is tracked to the same bytes, compressed or not") {
    check_replay(joined(images(), {"--fps", "25"}), {});
    const TestFolder folder;
    for (const char* format : {"png", "pnm"}) {
        CAPTURE(format);
        const std::string out = folder / format;
        REQUIRE(record(joined(images(), {"--format", format}), out) == 0);
        const auto copies = images_of(out + "/right"), originals = images_of(sequence() / "right");
        REQUIRE(copies.size() == kFrames);
        for (std::size_t i = 0; i < kFrames; ++i)
            CHECK(cv::norm(cv::imread(copies[i].string()), cv::imread(originals[i].string()),
                           cv::NORM_INF) == 0);
        const auto json = json_of(out + "/recording.json");
        CHECK(json["frames"] == kFrames);
        CHECK(json["fps"] == 30);
        CHECK(json["end"] == "complete");
        CHECK(json["frames_dropped"] == 0);
        CHECK_FALSE(has_partial_files(out));
    }
    CHECK(TestFolder::read(folder / "png/times.csv") ==
          "frame,timestamp_ms\n0,0.000000000\n1,33.333333333\n2,66.666666667\n"
          "3,100.000000000\n4,133.333333333\n");
    CHECK(json_of(folder / "png/recording.json")["bytes"].get<std::uint64_t>() <
          json_of(folder / "pnm/recording.json")["bytes"].get<std::uint64_t>());
}

TEST_CASE("a recording of two videos, of one with both views, and of fields, likewise") {
    const Videos videos;
    check_replay(videos.source(), {});
    const TestFolder folder;
    const std::string both = folder / "both";
    fs::create_directory(both);
    for (int i = 0; i < kFrames; ++i) {
        cv::Mat stacked;
        const auto file = static_cast<std::size_t>(i);
        cv::vconcat(cv::imread(images_of(sequence() / "left")[file].string()),
                    cv::imread(images_of(sequence() / "right")[file].string()), stacked);
        // Gray images stay gray.
        cv::cvtColor(stacked, stacked, cv::COLOR_BGR2GRAY);
        cv::imwrite(both + "/" + std::to_string(i) + ".png", stacked);
    }
    const Words source{"--stereo", both, "--layout", "top-bottom"};
    check_replay(source, {});
    check_replay(source, {"--interlaced", "top-first"}, {"--format", "pnm"});
}

TEST_CASE("a recording in H.264 is near its source, at its times to the nanosecond") {
    const TestFolder folder;
    const std::string times =
        folder.write("times.csv",
                     "frame,timestamp_ms\n0,0.000000000\n1,20.000000000\n2,70.000000000\n"
                     "3,110.500000000\n4,110.500001000\n");
    const Words source = joined(images(), {"--times", times});
    const std::string out = folder / "recording";
    REQUIRE(record(joined(source, {"--format", "h264"}), out) == 0);
    const auto json = json_of(out + "/recording.json");
    CHECK(json["format"] == "h264");
    CHECK(json["lossless"] == false);
    CHECK(json["frames"] == kFrames);
    CHECK(json["bytes"] == fs::file_size(out + "/left.mkv") + fs::file_size(out + "/right.mkv"));
    CHECK(TestFolder::read(out + "/times.csv") == TestFolder::read(times));
    CHECK_FALSE(fs::exists(out + "/left"));
    CHECK_FALSE(has_partial_files(out));
    for (const char* view : {"left", "right"}) {
        cv::VideoCapture video(out + "/" + view + ".mkv", cv::CAP_FFMPEG);
        cv::Mat image;
        for (const fs::path& file : images_of(sequence() / view)) {
            REQUIRE(video.read(image));
            const cv::Mat before = cv::imread(file.string());
            REQUIRE(image.size() == before.size());
            const double away = cv::norm(image, before, cv::NORM_L1) / double(image.total() * 3);
            CHECK(away < 6);  // gray levels; another frame, or the other view, is farther
            CHECK(away > 0);
        }
        CHECK_FALSE(video.read(image));
    }
    REQUIRE(track(source, folder / "direct") == 0);
    REQUIRE(track({"--recording", out}, folder / "replayed") == 0);
    const auto timestamps = [&](const char* run) {
        std::vector<std::string> found;
        CsvReader rows(folder.path() / run / "frames.csv", {"timestamp_ms", "state"});
        while (rows.next()) {
            found.emplace_back(rows.field(0));
            CHECK(rows.field(1) == "tracking");
        }
        return found;
    };
    CHECK(timestamps("direct").size() == kFrames);
    CHECK(timestamps("direct") == timestamps("replayed"));
    // Gray images come back as such in colour.
    fs::create_directories(folder.path() / "gray/left");
    fs::create_directories(folder.path() / "gray/right");
    for (const char* view : {"left", "right"})
        for (const fs::path& file : images_of(sequence() / view))
            cv::imwrite((folder.path() / "gray" / view / file.filename()).string(),
                        cv::imread(file.string(), cv::IMREAD_GRAYSCALE));
    REQUIRE(record({"--left", folder / "gray/left", "--right", folder / "gray/right", "--format",
                    "h264"},
                   folder / "of_gray") == 0);
    CHECK(json_of(folder / "of_gray/recording.json")["channels"] == 1);
    CHECK(track({"--recording", folder / "of_gray"}, folder / "tracked") == 0);
}

TEST_CASE("H.264 that cannot be had: of an odd size, without an encoder, on a full disk") {
    const TestFolder folder;
    for (const char* view : {"left", "right"}) {
        fs::create_directory(folder / view);
        for (int i = 0; i < 3; ++i)
            cv::imwrite(folder / view + "/" + std::to_string(i) + ".png",
                        cv::Mat(240, 321, CV_8UC3, cv::Scalar::all(90)));
    }
    CHECK(record({"--left", folder / "left", "--right", folder / "right", "--format", "h264"},
                 folder / "odd") == 2);
    const Words h264 = joined({"record", "--quiet", "--format", "h264"}, images());
    // OpenCV as it is without FFmpeg.
    ::setenv("OPENCV_VIDEOIO_PRIORITY_FFMPEG", "0", 1);
    ChildProgram without(joined(h264, {"--out", folder / "without"}));
    ::unsetenv("OPENCV_VIDEOIO_PRIORITY_FFMPEG");
    CHECK(without.exit_code() == 2);
    CHECK_FALSE(fs::exists(folder / "without/recording.json"));
    // A disk on which some frames have room, and one on which none has.
    CHECK(ChildProgram(joined(h264, {"--out", folder / "full"}), -1, 9000).exit_code() == 7);
    CHECK_FALSE(fs::exists(folder / "full/recording.json"));
    CHECK_FALSE(has_partial_files(folder / "full"));
    CHECK(ChildProgram(joined(h264, {"--out", folder / "none"}), -1, 3000).exit_code() == 7);
    CHECK(fs::is_empty(folder / "none"));
}

TEST_CASE("videos of a full disk have the images that times and message tell of") {
    const TestFolder folder;
    for (const char* view : {"left", "right"}) {
        fs::create_directory(folder / view);
        for (int i = 0; i < 24; ++i) {
            cv::Mat image(240, 320, CV_8UC3);
            cv::randu(image, 0, 256);
            cv::imwrite(folder / view + "/" + std::to_string(10 + i) + ".png", image);
        }
    }
    const std::string out = folder / "full";
    const int own = ::dup(STDERR_FILENO),
              file = ::open((folder / "said").c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600);
    ::dup2(file, STDERR_FILENO);
    ChildProgram program({"record", "--quiet", "--format", "h264", "--left", folder / "left",
                          "--right", folder / "right", "--out", out},
                         -1, 400'000);
    ::dup2(own, STDERR_FILENO);
    ::close(own);
    ::close(file);
    CHECK(program.exit_code() == 7);
    CHECK_FALSE(fs::exists(out + "/recording.json"));
    CHECK_FALSE(has_partial_files(out));
    const std::string times = TestFolder::read(out + "/times.csv");
    const auto frames = std::count(times.begin(), times.end(), '\n') - 1;
    CHECK(frames > 2);
    CHECK(frames < 24);
    const std::string said = TestFolder::read(folder / "said");
    CAPTURE(said);
    CHECK(said.find("mkv: not all of 24 images are in the video; is the disk full? " +
                    std::to_string(frames) + " frames and their times") != std::string::npos);
    for (const char* view : {"left", "right"}) {
        cv::VideoCapture video(out + "/" + view + ".mkv", cv::CAP_FFMPEG);
        cv::Mat image;
        for (int i = 0; i < frames; ++i) {
            CAPTURE(i);
            REQUIRE(video.read(image));
            const auto away_of = [&](int other) {
                return cv::norm(
                    image, cv::imread(folder / view + "/" + std::to_string(10 + other) + ".png"));
            };
            CHECK(away_of(i) < 0.9 * away_of(i + 1));
        }
    }
    // As many as a recording has can be tracked or copied.
    CHECK(record({"--left", out + "/left.mkv", "--right", out + "/right.mkv", "--times",
                  out + "/times.csv", "--frames", std::string(":").append(std::to_string(frames))},
                 folder / "copy") == 0);
}

TEST_CASE("rates that no encoder takes are recorded in H.264 all the same") {
    const TestFolder folder;
    for (const char* fps : {"0.001", "0.02", "240", "10000"}) {
        const std::string out = folder / fps;
        CAPTURE(fps);
        REQUIRE(record(joined(images(), {"--format", "h264", "--fps", fps}), out) == 0);
        CHECK(json_of(out + "/recording.json")["frames"] == kFrames);
        CHECK(json_of(out + "/recording.json")["fps"] == std::stod(fps));
    }
}

TEST_CASE("uneven times are replayed, and a recording can be recorded") {
    const TestFolder folder;
    const std::string times =
        folder.write("times.csv",
                     "frame,timestamp_ms\n0,0.000000000\n1,20.000000000\n2,70.000000000\n"
                     "3,110.500000000\n4,110.500001000\n");
    const Words source = joined(images(), {"--times", times});
    check_replay(source, {});
    check_replay(source, {"--template-frame", "3"});
    REQUIRE(record(source, folder / "first") == 0);
    REQUIRE(record({"--recording", folder / "first"}, folder / "second") == 0);
    CHECK(TestFolder::read(folder / "second/times.csv") == TestFolder::read(times));
    CHECK(TestFolder::read(folder / "second/left/000004.png") ==
          TestFolder::read(folder / "first/left/000004.png"));
    REQUIRE(record(joined(source, {"--frames", "1:3"}), folder / "part") == 0);
    CHECK(TestFolder::read(folder / "part/times.csv") ==
          "frame,timestamp_ms\n0,20.000000000\n1,70.000000000\n");
    // A run is repeated by its summary, from the recording or from another source.
    REQUIRE(track({"--recording", folder / "first"}, folder / "a") == 0);
    const std::string summary = folder / "a/summary.json";
    REQUIRE(run({"track", "--quiet", "--like", summary, "--out", folder / "b"}) == 0);
    CHECK(TestFolder::read(folder / "a/points.csv") == TestFolder::read(folder / "b/points.csv"));
    REQUIRE(run(joined({"track", "--quiet", "--like", summary, "--out", folder / "c"}, images())) ==
            0);
}

TEST_CASE("a view that ends early: exit code 3, and a recording of the pairs before") {
    const Videos videos(3);
    const TestFolder folder;
    CHECK(record(videos.source(), folder / "recording") == 3);
    const auto json = json_of(folder / "recording/recording.json");
    CHECK(json["frames"] == 3);
    CHECK(json["end"] == "input failed");
    CHECK(json["fault"].get<std::string>().find("ends after 3 frames") != std::string::npos);
    CHECK(images_of(folder / "recording/left").size() == 3);
    CHECK(track({"--recording", folder / "recording"}, folder / "out") == 0);
    // Images that do not pair up are refused before anything is written.
    fs::copy(sequence() / "right", folder / "right");
    fs::remove(images_of(folder / "right").back());
    CHECK(record({"--left", sequence() / "left", "--right", folder / "right"}, folder / "none") ==
          3);
    CHECK_FALSE(fs::exists(folder / "none"));
}

TEST_CASE("a folder that cannot be written, or holds anything: exit codes 7 and 2") {
    const TestFolder folder;
    CHECK(record(images(), folder.write("file", "x") + "/out") == 7);
    CHECK(record(images(), folder.path().string()) == 2);
    CHECK(TestFolder::read(folder / "file") == "x");
    const std::string before = TestFolder::read(images_of(sequence() / "left")[0]);
    CHECK(record(images(), sequence() / "left") == 2);
    CHECK(TestFolder::read(images_of(sequence() / "left")[0]) == before);
    REQUIRE(record(images(), folder / "recording") == 0);
    CHECK(record(images(), folder / "recording") == 2);
    CHECK(record({}, folder / "out") == 2);
    CHECK(record({"--recording", folder / "recording", "--fps", "3"}, folder / "out") == 2);
    CHECK(record(joined(images(), {"--queue", "0"}), folder / "out") == 2);
    // A recording is no output of a run.
    for (const char* name : {"recording.json", "times.csv"})
        CHECK(run({"track", "--quiet", "--recording", folder / "recording", "--calibration",
                   sequence() / "calibration.yaml", "--out", folder / "out", "--trace",
                   folder / "recording/" + name}) == 2);
}

TEST_CASE("row 73: Ctrl-C ends a recording, which is then finished; exit code 130") {
    Long recorder;
    CHECK(recorder.end(SIGINT) == 130);
    const auto json = json_of(recorder.out + "/recording.json");
    const auto frames = json["frames"].get<std::size_t>();
    CHECK(json["end"] == "interrupted");
    CHECK(frames >= 4);
    CHECK(frames < 2000);
    CHECK(images_of(recorder.out + "/left").size() == frames);
    CHECK(images_of(recorder.out + "/right").size() == frames);
    CHECK_FALSE(has_partial_files(recorder.out));
    CHECK(track({"--recording", recorder.out, "--frames", ":3"}, recorder.folder / "out") == 0);
}

TEST_CASE("a recording that was killed never looks finished; its pairs are whole") {
    Long recorder;
    CHECK(recorder.end(SIGKILL) == -SIGKILL);
    CHECK_FALSE(fs::exists(recorder.out + "/recording.json"));
    CHECK_FALSE(fs::exists(recorder.out + "/times.csv"));
    CHECK(track({"--recording", recorder.out}, recorder.folder / "out") == 3);
    CHECK(record(images(), recorder.out) == 2);
    // As the guide says: times of what was written, and the images that have both.
    std::string times;
    std::size_t pairs = 0;
    for (const fs::path& file : images_of(recorder.out))
        if (file.filename().string().find("times.") == 0) times = file.string();
    REQUIRE_FALSE(times.empty());
    const std::string text = TestFolder::read(times);
    pairs = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')) - 1;
    REQUIRE(pairs >= 3);
    const auto lefts = images_of(recorder.out + "/left");
    // The run may have ended between the views of a pair.
    for (const fs::path& file : lefts)
        if (!fs::exists(recorder.out + "/right/" + file.filename().string())) fs::remove(file);
    const std::string range = std::string(":").append(std::to_string(pairs));
    const TestFolder folder;
    CHECK(record({"--left", recorder.out + "/left/%06d.png", "--right",
                  recorder.out + "/right/%06d.png", "--times", times, "--frames", range},
                 folder / "rescued") == 0);
    CHECK(json_of(folder / "rescued/recording.json")["frames"] == pairs);
}

TEST_CASE("a full disk: exit code 7, no half image, and not a finished recording") {
    const TestFolder folder;
    // Images that compress to almost nothing, and then some that do not.
    for (const char* view : {"left", "right"}) {
        fs::create_directory(folder / view);
        for (int i = 0; i < 6; ++i) {
            cv::Mat image(240, 320, CV_8UC3, cv::Scalar::all(40));
            if (i >= 3) cv::randu(image, 0, 256);
            cv::imwrite(folder / view + "/" + std::to_string(i) + ".png", image);
        }
    }
    const std::string out = folder / "recording";
    ChildProgram program(
        {"record", "--quiet", "--left", folder / "left", "--right", folder / "right", "--out", out},
        -1, 50000);
    CHECK(program.exit_code() == 7);
    CHECK(images_of(out + "/left").size() == 3);
    CHECK(images_of(out + "/right").size() == 3);
    CHECK_FALSE(has_partial_files(out));
    CHECK_FALSE(fs::exists(out + "/recording.json"));
    CHECK(TestFolder::read(out + "/times.csv").find("\n2,") != std::string::npos);
    CHECK(TestFolder::read(out + "/times.csv").find("\n3,") == std::string::npos);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST_CASE("a recording that fails by whatever else keeps its images and their times") {
    const TestFolder folder;
    for (const char* view : {"left", "right"}) fs::copy(sequence() / view, folder / view);
    // An image for which there is no memory.
    constexpr std::uintmax_t kImageBytes = 399'000'000, kEnough = 350'000'000;
    const std::string image = (folder / "left") + "/999999.png";
    folder.write("left/999999.png", "");
    fs::resize_file(image, kImageBytes);
    fs::copy(images_of(folder / "right").back(), (folder / "right") + "/999999.png");
    const MemoryLimit limit(kEnough);
    CHECK(record({"--left", folder / "left", "--right", folder / "right"}, folder / "out") == 1);
    const std::string times = TestFolder::read(folder / "out/times.csv");
    CHECK(std::count(times.begin(), times.end(), '\n') == 1 + kFrames);
    CHECK(images_of(folder / "out/right").size() == kFrames);
    CHECK_FALSE(fs::exists(folder / "out/recording.json"));
}
#endif
