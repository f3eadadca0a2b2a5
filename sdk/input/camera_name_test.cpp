// Names of cameras as they are shown.
#include "sdk/input/camera_name.hpp"

#include <doctest/doctest.h>

using namespace defrec::cli;

TEST_CASE("users and passwords are in no source that is shown") {
    CHECK(shown_source("rtsp://user:secret@host:554/left") == "rtsp://***@host:554/left");
    CHECK(shown_source("rtsps://user:s@cret@host?x") == "rtsps://***@host?x");
    CHECK(shown_source("rtspt://token@host") == "rtspt://***@host");
    CHECK(
        shown_source("gst:rtspsrc location=\"rtsp://u:secret@host/a\" ! x uri=rtsp://u:s@b ! y") ==
        "gst:rtspsrc location=\"rtsp://***@host/a\" ! x uri=rtsp://***@b ! y");
    CHECK(shown_source("gst:rtspsrc user-id=u user-pw=secret ! x user-pw = \"a secret\" ! y") ==
          "gst:rtspsrc user-id=u user-pw=*** ! x user-pw = \"***\" ! y");
    CHECK(shown_source("gst:rtspsrc user-pw='a secret") == "gst:rtspsrc user-pw='***");
    for (const char* open : {"rtsp://host/left", "rtsp://host/user@home", "rtsp://host?user@home",
                             "/dev/video0", "left/%06d.png", "a@b.mp4", "user-pw/left.mp4",
                             "gst:x user-pw", "gst:x user-pw=", "://", ""})
        CHECK(shown_source(open) == open);
}

TEST_CASE("an address that was shown is known by its mark") {
    CHECK(without_hidden_user(shown_source("rtsp://user:secret@host/left")) == "rtsp://host/left");
    CHECK_FALSE(without_hidden_user("rtsp://host/left"));
    CHECK_FALSE(without_hidden_user("rtsp://user@host/left"));
    CHECK_FALSE(without_hidden_user("***@left.mp4"));
}
