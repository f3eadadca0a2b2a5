// Names of runs.
#include "sdk/session/run_name.hpp"

#include <doctest/doctest.h>

using namespace defrec::cli;

namespace {

std::string name_of(const char* left, const char* right) {
    SourceOptions source;
    source.left = left;
    source.right = right;
    return run_name(source, false, "results/case 7/");
}

}  // namespace

TEST_CASE("a run has the name of the folder that holds both views") {
    CHECK(name_of("/data/liver/left", "/data/liver/right/") == "liver");
    CHECK(name_of("/data/liver/left/%06d.png", "/data/liver/right/%06d.png") == "liver");
    CHECK(name_of("/data/liver/left.mp4", "/data/liver/right.mp4") == "liver");
    CHECK(name_of("/data/liver/x/../left", "/data/liver/right") == "liver");
    CHECK(name_of("/data/liver/left", "/data/liver/left") == "liver");
    CHECK(name_of("left", "right") == std::filesystem::current_path().filename().string());
    CHECK(name_of("/left", "/right") == "case 7");
}

TEST_CASE("a camera or a file with both views is named as it was given") {
    SourceOptions source;
    source.left = "/dev/video0";
    source.right = "/dev/video2";
    CHECK(run_name(source, true, "out") == "/dev/video0");
    source.left = "rtsp://user:secret@host/left";
    CHECK(run_name(source, true, "out") == "rtsp://***@host/left");
    source.stereo = "videos/both.mp4";
    CHECK(run_name(source, false, "out") == "videos/both.mp4");
}
