// Times of recorded images: what is read, and what is refused.
#include "sdk/input/frame_times.hpp"

#include <doctest/doctest.h>

#include <opencv2/imgcodecs.hpp>

#include "sdk/input/recorded_folder.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"

using namespace defrec::cli;

namespace {

// A recording of so many images, of which each view's are of one gray value.
struct Recorded {
    explicit Recorded(int images) {
        for (const char* view : {"left", "right"}) {
            std::filesystem::create_directory(folder / view);
            for (int i = 0; i < images; ++i)
                cv::imwrite(folder / view + "/" + std::to_string(i) + ".png",
                            cv::Mat(64, 96, CV_8UC1, cv::Scalar(10 + i)));
        }
        folder.write("recording.json", R"({"frames": 3, "fps": 25})");
        folder.write("times.csv", "frame,timestamp_ms\n0,5.25\n1,40.25\n2,90.25\n");
    }
    std::vector<double> times(const SourceOptions& options, std::string& fault) const {
        FrameSource source(options);
        std::vector<double> read;
        StereoFrame frame;
        while (source.next(frame)) read.push_back(frame.timestamp_ms);
        fault = source.fault();
        return read;
    }
    SourceOptions options() const {
        SourceOptions source;
        open_recorded_folder(folder.path(), source);
        return source;
    }
    std::string refusal() const {
        return refusal_of([&] { options(); });
    }
    TestFolder folder;
};

}  // namespace

TEST_CASE("frames of a recording have its times and its rate, also from a later frame on") {
    const Recorded recorded(3);
    SourceOptions options = recorded.options();
    std::string fault;
    CHECK(recorded.times(options, fault) == std::vector<double>{5.25, 40.25, 90.25});
    CHECK(fault.empty());
    CHECK(FrameSource(options).fps() == 25);
    options.range = {1, {}};
    CHECK(recorded.times(options, fault) == std::vector<double>{40.25, 90.25});
    options.range = {0, 2};
    CHECK(recorded.times(options, fault) == std::vector<double>{5.25, 40.25});
    CHECK(fault.empty());
    // Without a rate it is the times' own.
    options.fps = 0;
    CHECK(FrameSource(options).fps() == 20);
    options.fields = FieldOrder::kTopFirst;
    options.range = {};
    CHECK(recorded.times(options, fault) ==
          std::vector<double>{5.25, 30.25, 40.25, 65.25, 90.25, 115.25});
    // A field comes before the next image, also where that is early.
    options.fps = 10;
    CHECK(recorded.times(options, fault) ==
          std::vector<double>{5.25, 22.75, 40.25, 65.25, 90.25, 140.25});
}

TEST_CASE("more images than times, and more times than images, are told after the frames") {
    std::string fault;
    const Recorded few(2), many(4);
    CHECK(few.times(few.options(), fault).size() == 2);
    CHECK_SAYS(fault, "has the times of 3 images, but there are only 2");
    CHECK(many.times(many.options(), fault).size() == 3);
    CHECK_SAYS(fault, "ends after the times of 3 images");
}

TEST_CASE("a folder that holds no finished recording is refused") {
    const Recorded recorded(3);
    recorded.folder.write("recording.json", R"({"frames": 4, "fps": 25})");
    CHECK_SAYS(recorded.refusal(), "says 4 frames, but times.csv has 3");
    for (const char* text : {"", "[]", R"({"frames": 3})", R"({"frames": -3, "fps": 25})",
                             R"({"frames": 3, "fps": "25"})"}) {
        CAPTURE(text);
        recorded.folder.write("recording.json", text);
        CHECK_SAYS(recorded.refusal(), "recording.json");
    }
    recorded.folder.write("recording.json", R"({"frames": 3, "fps": 0})");
    CHECK_SAYS(recorded.refusal(), "no rate");
    std::filesystem::remove(recorded.folder / "recording.json");
    CHECK_SAYS(recorded.refusal(), "not finished");
}

TEST_CASE("times that are none of frames in their order are refused, with the line") {
    const TestFolder folder;
    const auto refusal = [&](const std::string& text) {
        const std::string path = folder.write("times.csv", text);
        return refusal_of([&] { read_frame_times(path); });
    };
    CHECK_SAYS(refusal("frame,timestamp_ms\n"), "no times");
    CHECK_SAYS(refusal("frame,time\n0,1\n"), "timestamp_ms");
    CHECK_SAYS(refusal("frame,timestamp_ms\n0,1\n2,2\n"), ":3: ");
    CHECK_SAYS(refusal("frame,timestamp_ms\n0,1\n2,2\n"), "frame 1 was expected");
    CHECK_SAYS(refusal("frame,timestamp_ms\n0,1\n1,1\n"), "not after");
    CHECK_SAYS(refusal("frame,timestamp_ms\n0,nan\n"), "timestamp_ms");
    CHECK_SAYS(refusal("frame,timestamp_ms\n0,1e13\n"), "beyond");
}
