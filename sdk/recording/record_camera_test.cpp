// A recording of cameras, which GStreamer's test images stand for.
#include <doctest/doctest.h>
#include <gst/gst.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <string>

#include "sdk/input/frame_times.hpp"
#include "sdk/input/recorded_folder.hpp"
#include "sdk/input/view_image.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/recording/run_record.hpp"

using namespace defrec::cli;

TEST_CASE("a recording of two cameras has their images and times, and counts what it has not") {
    gst_init(nullptr, nullptr);
    GstElementFactory* images = gst_element_factory_find("videotestsrc");
    if (images == nullptr) {
        MESSAGE("skipped: GStreamer has no element videotestsrc");
        return;
    }
    gst_object_unref(images);
    const TestFolder folder;
    RecordOptions options;
    options.source.left = options.source.right =
        "gst:videotestsrc is-live=true pattern=ball num-buffers=20 ! "
        "video/x-raw,format=GRAY8,width=160,height=120,framerate=20/1,"
        "from=(string)\"rtsp://user:secret@host\"";
    options.out = folder / "recording";
    options.quiet = true;
    REQUIRE(run_record(options) == 0);
    const auto json = nlohmann::json::parse(TestFolder::read(folder / "recording/recording.json"));
    const auto frames = json["frames"].get<std::int64_t>();
    CHECK(frames > 1);
    CHECK(json["channels"] == 1);
    CHECK(json["fps"] == 20);
    CHECK(json["end"] == "complete");
    for (const char* view : {"left", "right"}) {
        const auto source = json[view].get<std::string>();
        CHECK(source.find("\"rtsp://***@host\"") != std::string::npos);
    }
    const nlohmann::json& cameras = json["cameras"];
    CHECK(frames + json["frames_dropped"].get<std::int64_t>() +
              cameras["frames_missed"].get<std::int64_t>() ==
          cameras["frames_received"].get<std::int64_t>());

    SourceOptions recorded;
    open_recorded_folder(folder.path() / "recording", recorded);
    const auto times = read_frame_times(recorded.times);
    CHECK(times.front() == 0);
    FrameSource source(recorded);
    StereoFrame frame;
    std::size_t count = 0;
    for (; source.next(frame); ++count) {
        CHECK(frame.timestamp_ms == times.at(count));
        // The ball.
        for (const ImageView& view : {frame.left, frame.right}) {
            CHECK(view.channels == 1);
            CHECK(cv::countNonZero(mat_of(view)) > 10);
        }
    }
    CHECK(source.fault().empty());
    CHECK(static_cast<std::int64_t>(count) == frames);
}
