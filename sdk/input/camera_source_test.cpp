// Cameras by GStreamer's own sources of test images.
#include "sdk/input/camera_source.hpp"

#include <doctest/doctest.h>
#include <gst/gst.h>

#include <chrono>
#include <string>
#include <thread>

#include "sdk/input/camera_name.hpp"
#include "sdk/input/frame_source.hpp"
#include "sdk/io/test_refusal.hpp"

using namespace defrec::cli;

namespace {

// Tests pass without GStreamer's plugins, which are packages of their own.
bool has_plugins() {
    gst_init(nullptr, nullptr);
    for (const char* name :
         {"videotestsrc", "videoconvert", "identity", "jpegenc", "decodebin", "v4l2src"}) {
        GstElementFactory* factory = gst_element_factory_find(name);
        if (factory == nullptr) {
            MESSAGE("skipped: GStreamer has no element " << name);
            return false;
        }
        gst_object_unref(factory);
    }
    return true;
}

// A live camera; `more`: other elements, with "!" after each.
std::string camera(const std::string& size = "width=96,height=64", const std::string& more = "") {
    return "gst:videotestsrc is-live=true pattern=gradient ! video/x-raw,format=I420," + size +
           ",framerate=100/1 ! " + more + "identity silent=true";
}

SourceOptions two_cameras(const std::string& left, const std::string& right) {
    SourceOptions options;
    options.left = left;
    options.right = right;
    return options;
}

SourceOptions one_camera(const std::string& stereo) {
    SourceOptions options;
    options.stereo = stereo;
    return options;
}

std::string refusal(const SourceOptions& options) {
    return refusal_of([&] { FrameSource source(options); });
}

}  // namespace

TEST_CASE("cameras have names that no recording has") {
    CHECK(parse_camera("rtsp://127.0.0.1:8554/left").kind == CameraName::Kind::kRtsp);
    CHECK(parse_camera("rtspt://endoscope/left").address == "rtspt://endoscope/left");
    CHECK(parse_camera("gst:videotestsrc").address == "videotestsrc");
    CHECK(parse_camera("/dev/null").kind == CameraName::Kind::kDevice);
    for (const char* recording : {"left.mp4", "left/%06d.png", "/tmp", "", "rtsp.mp4"})
        CHECK(parse_camera(recording).kind == CameraName::Kind::kNone);
}

TEST_CASE("two cameras deliver pairs whose times grow from 0") {
    if (!has_plugins()) return;
    FrameSource source(two_cameras(camera(), camera("width=96,height=64", "queue ! ")));
    CHECK(source.is_live());
    CHECK(source.width() == 96);
    CHECK(source.height() == 64);
    CHECK(source.fps() == 100);
    CHECK(source.expected() == std::nullopt);
    StereoFrame frame;
    double last_ms = -1;
    for (int i = 0; i < 20; ++i) {
        REQUIRE(source.next(frame));
        CHECK(frame.index == i);
        CHECK((i == 0 ? frame.timestamp_ms == 0 : frame.timestamp_ms > last_ms));
        last_ms = frame.timestamp_ms;
        CHECK(frame.left.channels == 3);
        CHECK(frame.left.pixels != frame.right.pixels);
    }
    // Cameras of 100 frames per second were asked for 20.
    CHECK(last_ms >= 19 * 10.0 - 5);
    const CameraCounts counts = source.camera_counts().value();
    CHECK(counts.pairs.pairs >= 20);
    CHECK(counts.reconnections == 0);
}

TEST_CASE("one camera with both views is cut in two") {
    if (!has_plugins()) return;
    SourceOptions options = one_camera(camera("width=192,height=64"));
    options.range = parse_frame_range("2:5");
    FrameSource source(options);
    CHECK(source.width() == 96);
    StereoFrame frame;
    for (int i = 2; i < 5; ++i) {
        REQUIRE(source.next(frame));
        CHECK(frame.index == i);
        CHECK(frame.right.pixels == frame.left.pixels + 96 * 3);
    }
    CHECK_FALSE(source.next(frame));
    CHECK(source.fault() == "");
    options.layout = Layout::kTopBottom;
    CHECK(FrameSource(options).height() == 32);
}

TEST_CASE("gray cameras stay gray") {
    if (!has_plugins()) return;
    CHECK(FrameSource(one_camera("gst:videotestsrc is-live=true ! "
                                 "video/x-raw,format=GRAY8,width=192,height=64"))
              .channels() == 1);
}

TEST_CASE("encoded images are decoded") {
    if (!has_plugins()) return;
    FrameSource source(one_camera(camera("width=192,height=64", "jpegenc ! decodebin ! ")));
    StereoFrame frame;
    CHECK(source.next(frame));
    CHECK(source.width() == 96);
}

TEST_CASE("who is slow gets the newest frame, and the others are counted") {
    if (!has_plugins()) return;
    FrameSource source(one_camera(camera()));
    StereoFrame frame;
    REQUIRE(source.next(frame));
    const double first_ms = frame.timestamp_ms;
    const auto pairs_so_far = [&source] { return source.camera_counts()->pairs.pairs; };
    const auto before = pairs_so_far();
    while (pairs_so_far() < before + 20) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    REQUIRE(source.next(frame));
    CHECK(frame.index == 1);
    CHECK(frame.timestamp_ms - first_ms >= 20 * 10.0 - 1);  // 100 pairs/s
    CHECK(source.camera_counts()->pairs.dropped >= before + 20 - 2);
}

TEST_CASE("a frame stays valid while newer ones come and after its camera is gone") {
    if (!has_plugins()) return;
    StereoFrame kept;
    int sum = 0;
    const auto sum_of = [&kept] {
        int total = 0;
        for (int y = 0; y < kept.left.height; ++y) total += kept.left.pixels[y * kept.left.stride];
        return total;
    };
    {
        FrameSource source(one_camera(camera()));
        REQUIRE(source.next(kept));
        sum = sum_of();
        StereoFrame frame;
        for (int i = 0; i < 5; ++i) REQUIRE(source.next(frame));
    }
    CHECK(sum > 0);
    CHECK(sum_of() == sum);
}

TEST_CASE("a pipeline ends with its last image") {
    if (!has_plugins()) return;
    FrameSource source(one_camera(
        "gst:videotestsrc num-buffers=5 ! video/x-raw,width=96,height=64,framerate=50/1"));
    StereoFrame frame;
    double last_ms = 0;
    while (source.next(frame)) last_ms = frame.timestamp_ms;
    CHECK(source.fault() == "");
    CHECK(last_ms <= 80);
    CHECK(source.camera_counts()->reconnections == 0);
    CHECK(source.camera_counts()->pairs.pairs == 5);
}

TEST_CASE("a camera that stops is started again, and the time goes on") {
    if (!has_plugins()) return;
    FrameSource source(one_camera(camera("width=96,height=64", "identity error-after=10 ! ")));
    std::vector<std::string> notices;
    source.set_notice_handler([&](const std::string& notice) { notices.push_back(notice); });
    StereoFrame frame;
    double last_ms = -1;
    while (source.camera_counts()->reconnections < 2) {
        REQUIRE(source.next(frame));
        CHECK(frame.timestamp_ms > last_ms);
        last_ms = frame.timestamp_ms;
    }
    REQUIRE(notices.size() == 4);
    CHECK_SAYS(notices[0], "the camera stopped");
    CHECK_SAYS(notices[1], "the camera is back after");
    // The pause before a camera is started again.
    CHECK(source.camera_counts()->longest_gap_ms >= 500);
}

TEST_CASE("a camera that does not come back is a fault") {
    if (!has_plugins()) return;
    SourceOptions options = one_camera(camera("width=96,height=64", "identity error-after=10 ! "));
    options.reconnect_seconds = 0;
    FrameSource source(options);
    StereoFrame frame;
    while (source.next(frame)) {
    }
    CHECK_SAYS(source.fault(), "did not come back within 0 s");
    CHECK_FALSE(source.next(frame));
}

TEST_CASE("a camera that cannot be opened is refused with the reason") {
    if (!has_plugins()) return;
    const std::string unknown = refusal(one_camera("gst:no_such_element ! identity"));
    CHECK_SAYS(unknown, "no_such_element");
    CHECK_SAYS(unknown, "gstreamer1.0-plugins-good");
    CHECK_SAYS(refusal(one_camera("gst:videotestsrc !")), "does not accept this pipeline");
    const std::string device = refusal(one_camera("/dev/null"));
    CHECK_SAYS(device, "/dev/null");
    CHECK_MESSAGE(device.find("..") == std::string::npos, device);
    CHECK_SAYS(refusal(two_cameras(camera(), "left.mp4")), "is a camera and");
    CHECK_SAYS(refusal(one_camera("gst:x location=rtsp://user:secret@host")), "=rtsp://***@host");
    CHECK_SAYS(refusal(two_cameras("left.mp4", "rtsp://user:secret@host")), "rtsp://***@host is");
    CHECK_SAYS(refusal(two_cameras(camera(), camera("width=64,height=64"))),
               "they must be of one size");
}
