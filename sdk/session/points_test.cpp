// points.csv as input, and what its faults are answered with.
#include "sdk/session/points.hpp"

#include <doctest/doctest.h>

#include <cstdint>
#include <string>

#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"

using namespace defrec::cli;

namespace {

std::string refusal(const std::string& text) {
    const TestFolder folder;
    return refusal_of([&] { read_points(folder.write("points.csv", text), 640, 360); });
}

}  // namespace

TEST_CASE(
    "points are read, with CR LF, a byte order mark, blank lines and columns in another order") {
    const TestFolder folder;
    const auto points = read_points(
        folder.write("p.csv", "\xEF\xBB\xBFv, id,note,u\r\n1.5,7,a,2.25\r\n\r\n0,-3,,639.4\r\n"),
        640, 360);
    REQUIRE(points.size() == 2);
    CHECK(points[0].id == 7);
    CHECK(points[0].u == 2.25);
    CHECK(points[0].v == 1.5);
    CHECK(points[1].id == -3);
    CHECK_FALSE(points[0].frame);
}

TEST_CASE("points may be given in a frame of their own") {
    const TestFolder folder;
    const auto points =
        read_points(folder.write("p.csv", "id,u,v,frame\n1,2,3,20\n2,2,3,\n3,5,5,0\n"), 640, 360);
    REQUIRE(points.size() == 3);
    CHECK(points[0].frame == 20);
    CHECK_FALSE(points[1].frame);
    CHECK(points[2].frame == 0);
}

TEST_CASE("points may have names; those of the file are chosen, those of the grid are not") {
    const TestFolder folder;
    const auto points =
        read_points(folder.write("p.csv", "id,u,v,name\n1,2,3,vessel\n2,2,3,\n"), 640, 360);
    REQUIRE(points.size() == 2);
    CHECK(points[0].name == "vessel");
    CHECK(points[1].name.empty());
    CHECK(points[0].is_chosen);
    CHECK_FALSE(grid_points(640, 360)[0].is_chosen);
}

TEST_CASE("a first line that names no columns is answered with what is missing") {
    CHECK_SAYS(refusal("320,180\n200,100\n"), "the first line must name the columns: id,u,v");
    CHECK_SAYS(refusal("id;u;v\n1;2;3\n"), "semicolons or tabs, commas were expected");
    CHECK_SAYS(refusal("ID,u,v\n1,2,3\n"), "no column 'id'; the nearest is 'ID'");
    CHECK(refusal("name,u,v\nvessel,2,3\n").find("nearest is 'u'") == std::string::npos);
}

TEST_CASE("faulty points name the line") {
    CHECK_SAYS(refusal("id,u,v\n1,2,3\n2,5,5\n1,4,4\n"),
               "points.csv:4: id 1 stands already in line 2");
    CHECK_SAYS(refusal("id,u,v\n1,nan,3\n"), "points.csv:2: u: 'nan'");
    CHECK_SAYS(refusal("id,u,v\n1,2,inf\n"), "points.csv:2: v: 'inf'");
    CHECK_SAYS(refusal("id,u,v\n1,640,3\n"), "points.csv:2: the pixel 640.00,3.00 lies outside");
    CHECK_SAYS(refusal("id,u,v\n1,2,-1\n"), "outside");
    CHECK_SAYS(refusal("id,u,v\n1,2\n"), "points.csv:2: the line has 2 fields");
    CHECK_SAYS(refusal("id,u,v\n1.5,2,3\n"), "whole number");
    CHECK_SAYS(refusal("id,u,v\ntumour,2,3\n"),
               "points.csv:2: id: 'tumour' is not a whole number. Number the points; what they are "
               "called goes into a column 'name'.");
    CHECK_SAYS(refusal("id,u,v,frame\n1,2,3,x\n"), "points.csv:2: frame: 'x'");
    CHECK_SAYS(refusal("id,u,v,frame\n1,2,3,-4\n"), "points.csv:2: frame -4 is negative");
    CHECK_SAYS(refusal("id,x,v\n1,2,3\n"), "no column 'u'");
    CHECK_SAYS(refusal("id,u,v\n"), "no point");
    CHECK_SAYS(refusal(""), "empty");
    CHECK_SAYS(refusal(std::string("id,u,v\n1,\0,3\n", 13)), "binary");
}

TEST_CASE("the default grid lies inside the image") {
    const auto points = grid_points(64, 48);
    CHECK(points.size() == 144);
    for (const FollowedPoint& point : points) {
        CHECK(point.u >= 0);
        CHECK(point.u <= 63);
        CHECK(point.v >= 0);
        CHECK(point.v <= 47);
    }
}

TEST_CASE("row 124: a point more gets a free id, whatever ids there are") {
    CHECK(free_id({}) == 0);
    CHECK(free_id({{7, 0, 0, {}}, {3, 0, 0, {}}}) == 8);
    CHECK(free_id({{-5, 0, 0, {}}}) == 0);
    CHECK(free_id({{INT64_MAX, 0, 0, {}}, {0, 0, 0, {}}, {-1, 0, 0, {}}, {2, 0, 0, {}}}) == 1);
    CHECK(free_id({{INT64_MAX - 1, 0, 0, {}}}) == INT64_MAX);
}

TEST_CASE("of many ids the first few are named") {
    CHECK(first_ids({7}) == "id 7");
    CHECK(first_ids({7, -3, 9}) == "ids 7, -3 and 9");
    CHECK(first_ids({1, 2, 3, 4, 5}) == "ids 1, 2, 3, 4 and 5");
    CHECK(first_ids({1, 2, 3, 4, 5, 6}) == "ids 1, 2, 3, 4, 5, ...");
}
