// Lost and degraded frames in words.
#include "sdk/report/doubtful_frames.hpp"

#include <doctest/doctest.h>

using namespace defrec::cli;

namespace {

std::vector<std::string> words_of_list(const DoubtfulFramesList& list) {
    std::vector<std::string> lines;
    for (const DoubtfulFrames& each : list.sorted())
        lines.push_back(each.where() + " " + each.state + ": " + each.why);
    return lines;
}

}  // namespace

TEST_CASE("frames of a state are named with their main reason and its remedy") {
    DoubtfulFramesList list;
    list.add(10, "tracking", "few-matches", "");
    list.add(11, "degraded", "few-matches|occluded", "");
    for (int frame = 12; frame < 15; ++frame) list.add(frame, "lost", "dark, few-matches", "both");
    list.add(15, "relocalised", "", "");
    list.add(16, "lost", "few-matches", "");
    list.add(17, "degraded", "occluded", "");
    list.add(18, "tracking", "", "");
    CHECK(words_of_list(list) ==
          std::vector<std::string>{
              "frames 12 to 14 lost: both pictures are black; check light, lens and cable",
              "frame 16 lost: little of the tissue is recognised; move the camera back to where "
              "the tissue was last followed",
              "2 of the frames 11 to 17 degraded: something lies in front of the tissue; move it "
              "aside"});
}

TEST_CASE("frames without a reason that explains their state are named as well") {
    DoubtfulFramesList list;
    // Their numbers need not follow each other.
    list.add(0, "lost", "", "");
    list.add(2, "lost", "template-full", "");
    list.add(4, "degraded", "", "");
    list.add(6, "degraded", "piece-lost", "");
    CHECK(words_of_list(list) ==
          std::vector<std::string>{
              "frames 0 to 2 lost: little of the tissue is recognised; move the camera back to "
              "where the tissue was last followed",
              "frame 4 degraded: less is observed than usual",
              "frame 6 degraded: a part of the tissue is not found"});
}

TEST_CASE("the picture that is black or white is named where it is known") {
    DoubtfulFramesList list;
    list.add(0, "degraded", "dark|no-texture|one-view|no-depth", "right");
    list.add(1, "degraded", "saturated|one-view", "right");
    list.add(2, "degraded", "one-view", "right");
    list.add(3, "lost", "dark|no-texture|one-view", "left");
    list.add(4, "lost", "dark|no-texture", "both");
    list.add(5, "lost", "dark|saturated", "both");
    CHECK(words_of_list(list) ==
          std::vector<std::string>{
              "frame 3 lost: the left picture is black; check lens, cable and input of that view",
              "frame 4 lost: both pictures are black; check light, lens and cable",
              "frame 5 lost: a picture is black; check light, lens and cable",
              "frame 0 degraded: the right picture is black; check lens, cable and input of that "
              "view",
              "frame 1 degraded: the right picture is white; check lens, cable and input of that "
              "view",
              "frame 2 degraded: the right picture is missing; check lens, cable and input of that "
              "view"});
}

TEST_CASE("a picture that stands still alone is named, and no clock is to be set") {
    DoubtfulFramesList list;
    list.add(0, "degraded", "view-late|low-contrast", "right");
    list.add(1, "degraded", "view-late|low-contrast", "right");
    list.add(2, "degraded", "view-late", "left");
    list.add(3, "degraded", "view-late", "");
    CHECK(words_of_list(list) ==
          std::vector<std::string>{
              "frames 0 to 1 degraded: the right picture stands still; check that video input",
              "frame 2 degraded: the left picture stands still; check that video input",
              "frame 3 degraded: left and right picture are not of the same time; synchronise both "
              "views"});
}

TEST_CASE("what follows from smoke or blur does not hide it") {
    DoubtfulFramesList list;
    list.add(0, "lost", "few-matches|no-depth|low-contrast", "");
    list.add(1, "degraded", "few-matches|low-contrast", "");
    list.add(2, "degraded", "few-matches", "");
    CHECK(words_of_list(list) ==
          std::vector<std::string>{
              "frame 0 lost: smoke, blur, a wet or covered lens; clean the lens, let the smoke "
              "clear",
              "frame 1 degraded: smoke, blur, a wet or covered lens; clean the lens, let the smoke "
              "clear",
              "frame 2 degraded: little of the tissue is recognised"});
}

TEST_CASE("nothing is in doubt where all is followed") {
    DoubtfulFramesList list;
    list.add(0, "tracking", "occluded", "");
    list.add(1, "initialising", "few-matches", "");
    CHECK(list.sorted().empty());
    list.add(2, "initialising", "no-depth", "");
    CHECK(words_of_list(list) ==
          std::vector<std::string>{
              "frame 2 initialising: too little depth is measured; look whether something covers "
              "the tissue, check focus and distance"});
}

TEST_CASE("tissue that was never followed is not to be looked for where it was followed last") {
    DoubtfulFramesList list;
    list.add(0, "unfound", "few-matches", "");
    list.add(1, "unfound", "few-matches", "");
    list.add(2, "unfound", "dark", "both");
    CHECK(words_of_list(list) ==
          std::vector<std::string>{
              "frames 0 to 1 lost: little of the tissue is recognised; see whether it is the "
              "tissue of the template",
              "frame 2 lost: both pictures are black; check light, lens and cable"});
}
