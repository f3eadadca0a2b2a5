// What is recorded from the live view: it fails alone, and replaces nothing.
#include "sdk/session/view_recordings.hpp"

#include <doctest/doctest.h>

#include <string>

#include "sdk/io/test_folder.hpp"
#include "sdk/io/whole_video.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;

namespace {

constexpr int kWidth = 64, kHeight = 48;

ViewRecordings recordings_in(const fs::path& folder, bool leaves_out = false) {
    return {folder,
            [](const fs::path& path) {
                return std::make_unique<OverlayWriter>(path, kWidth, kHeight, 25,
                                                       [](const float*, std::size_t, float*) {});
            },
            leaves_out};
}

void add_pictures(ViewRecordings& recordings, int count) {
    const cv::Mat picture(kHeight, kWidth, CV_8UC3, cv::Scalar(40, 60, 160));
    for (int i = 0; i < count; ++i) {
        FrameRecord record;
        record.index = i;
        record.state = "tracking";
        recordings.add(picture, record);
    }
}

}  // namespace

TEST_CASE("a recording takes the next number that no file has, of an earlier run either") {
    const TestFolder folder;
    folder.write("recording_001.mp4", "of a run before");
    folder.write("recording_003.webm", "likewise");
    ViewRecordings recordings = recordings_in(folder.path());
    CHECK(recordings.name().empty());
    for (const char* name : {"recording_002.mp4", "recording_004.mp4"}) {
        recordings.start({});
        CHECK(recordings.name() == name);
        add_pictures(recordings, 3);
        recordings.stop();
        CHECK(recordings.name().empty());
    }
    recordings.start({});  // none comes: there is no file
    recordings.finish();
    CHECK(recordings.take_notes().empty());
    CHECK(recordings.written() ==
          std::vector<std::string>{"recording_002.mp4", "recording_004.mp4"});
    CHECK(readable_frames(folder / "recording_004.mp4") == 3);
    CHECK(TestFolder::read(folder / "recording_001.mp4") == "of a run before");
    CHECK_FALSE(fs::exists(folder / "recording_005.mp4"));
}

TEST_CASE("a recording that cannot be written is told of, and ends") {
    const TestFolder folder;
    ViewRecordings recordings = recordings_in(folder.path() / "none");
    recordings.start({});
    CHECK(recordings.name().empty());
    std::vector<std::string> notes = recordings.take_notes();
    REQUIRE(notes.size() == 1);
    CHECK(notes[0].find("recording_001") != std::string::npos);
    CHECK(recordings.take_notes().empty());

    // What stands in its way comes while it is made.
    fs::create_directory(folder.path() / "none");
    recordings.start({});
    CHECK(recordings.name() == "recording_002.mp4");
    add_pictures(recordings, 2);
    fs::create_directory(folder.path() / "none/recording_002.mp4");
    recordings.finish();
    CHECK(recordings.take_notes().size() == 1);
    CHECK(recordings.written().empty());
}

TEST_CASE("pictures for which the encoder is too slow are left out where nobody may wait") {
    const TestFolder folder;
    ViewRecordings recordings = recordings_in(folder.path(), true);
    recordings.start({});
    constexpr int kPictures = 500;
    add_pictures(recordings, kPictures);
    recordings.finish();
    const std::int64_t written = readable_frames(folder / "recording_001.mp4");
    CHECK(written >= 4);
    const std::vector<std::string> notes = recordings.take_notes();
    REQUIRE(notes.size() == (written < kPictures ? 1 : 0));
    if (!notes.empty())
        CHECK(notes[0].find("lacks " + std::to_string(kPictures - written) + " picture") !=
              std::string::npos);
}
