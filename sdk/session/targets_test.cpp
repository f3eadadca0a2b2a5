// targets.csv as input, and what its faults are answered with.
#include "sdk/session/targets.hpp"

#include <doctest/doctest.h>

#include <string>

#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"

using namespace defrec::cli;

namespace {

std::string refusal(const std::string& text) {
    const TestFolder folder;
    return refusal_of([&] { read_targets(folder.write("targets.csv", text)); });
}

}  // namespace

TEST_CASE("targets are read with and without their depth, and further columns are left out") {
    const TestFolder folder;
    const auto targets = read_targets(folder.write(
        "t.csv", "\xEF\xBB\xBFid,depth,name,x,y,z\r\n7,20,a tumour,-1.5,2,80\r\n-3,,,0,0,0.5\r\n"));
    REQUIRE(targets.size() == 2);
    CHECK(targets[0].id == 7);
    CHECK(targets[0].xyz == std::array<double, 3>{-1.5, 2, 80});
    CHECK(targets[0].depth == 20);
    CHECK(targets[1].id == -3);
    CHECK_FALSE(targets[1].depth);
    CHECK_FALSE(read_targets(folder.write("u.csv", "id,x,y,z\n1,2,3,4\n"))[0].depth);
}

TEST_CASE("faulty targets name the line") {
    CHECK_SAYS(refusal("id,x,y,z\n1,2,3,4\n2,5,5,5\n1,4,4,4\n"),
               "targets.csv:4: id 1 stands already in line 2");
    CHECK_SAYS(refusal("id,x,y,z\n1,nan,3,4\n"), "targets.csv:2: x: 'nan'");
    CHECK_SAYS(refusal("id,x,y,z\n1,2,3,inf\n"), "targets.csv:2: z: 'inf'");
    CHECK_SAYS(refusal("id,x,y,z,depth\n1,2,3,4,nan\n"), "targets.csv:2: depth: 'nan'");
    CHECK_SAYS(refusal("id,x,y,z\n1,2,3,-80\n"), "targets.csv:2: z is -80.00; more than 0");
    CHECK_SAYS(refusal("id,x,y,z\n1,2,3\n"), "targets.csv:2: the line has 3 fields");
    CHECK_SAYS(refusal("id,u,v\n1,2,3\n"), "no column 'x'");
    CHECK_SAYS(refusal("id,x,y,z\n"), "no target");
    CHECK_SAYS(refusal(""), "empty");
}

TEST_CASE("more targets than are followed are refused") {
    std::string text = "id,x,y,z\n";
    for (std::size_t i = 0; i < kMaxTargets; ++i) text += std::to_string(i) + ",0,0,1\n";
    CHECK(refusal(text) == "accepted");
    CHECK_SAYS(refusal(text + "-1,0,0,1\n"),
               "targets.csv:100002: the file has more than 100000 targets");
}

TEST_CASE("targets in metres or in another frame are told by where they lie beside the surface") {
    std::vector<std::array<float, 3>> surface;
    for (int i = 0; i < 5000; ++i)
        surface.push_back({float(i % 100) - 50, float(i / 100) - 25, 80 + float(i % 7)});
    std::vector<Target> beneath, in_metres;
    for (int i = 0; i < 8; ++i) {
        beneath.push_back({i, {5.0 * i, -2.0 * i, 90 + 5.0 * i}});
        in_metres.push_back({i, {5e-3 * i, -2e-3 * i, 0.09 + 5e-3 * i}});
    }
    CHECK(note_on_places(beneath, surface).text.empty());
    CHECK(note_on_places(in_metres, {}).text.empty());
    const TargetPlacesNote metres = note_on_places(in_metres, surface);
    CHECK(metres.is_most);
    CHECK_SAYS(metres.text,
               "8 of 8 targets lie more than 20 mm in front of the whole surface (ids 0, 1, 2, 3, "
               "4, ...). They may be in metres, or in the frame of a model");
    std::vector<Target> of_model = beneath;
    for (Target& target : of_model) target.xyz[1] += 300;
    CHECK_SAYS(note_on_places(of_model, surface).text,
               "8 of 8 targets lie more than 150 mm away from the surface");
    const TargetPlacesNote of_plan = note_on_places(in_metres, surface, TargetsOf::kPlan);
    CHECK(of_plan.is_most);
    CHECK_SAYS(of_plan.text, "8 of 8 targets of the plan lie more than 20 mm in front of");
    CHECK_SAYS(of_plan.text, "see the notes of `defrec register`, and make the plan again");
    // What a registration makes of metres where the model's origin is in the tissue.
    std::vector<Target> one_point = in_metres;
    for (Target& target : one_point) target.xyz[2] += 90;
    const TargetPlacesNote point = note_on_places(one_point, surface, TargetsOf::kPlan);
    CHECK(point.is_most);
    CHECK(point.text ==
          "All 8 targets of the plan lie within 0.04 mm of each other: they may be in metres where "
          "mm were expected.");
    CHECK(note_on_places({one_point[2]}, surface).text.empty());
    beneath[3].xyz[2] = 20;
    const TargetPlacesNote one = note_on_places(beneath, surface);
    CHECK_FALSE(one.is_most);
    CHECK(one.text ==
          "1 of 8 targets lie more than 20 mm in front of the whole surface (id 3): no tissue that "
          "is followed is there.");
}
