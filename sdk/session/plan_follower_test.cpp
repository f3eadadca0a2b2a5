// A plan in a frame, as pictures and receivers get it.
#include "sdk/session/plan_follower.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "sdk/io/exit_code.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"

using namespace defrec::cli;

namespace {

// Four vertices, of which one is unknown, and two targets, of which one is lost.
struct Example {
    std::shared_ptr<const PlanModel> model = std::make_shared<const PlanModel>(
        PlanModel{{0, 1, 2, 3, 2, 1, 1, 2, 4}, {{"organ", 0, 3}, {"vessel", 1, 1}}});
    MovedPoints points;
    PlanFrame frame;

    Example() {
        points.resize(7);
        for (std::size_t i = 0; i < points.xyz.size(); ++i)
            points.xyz[i] = 10 + static_cast<double>(i);
        for (std::size_t i = 0; i < points.expected_error_mm.size(); ++i)
            points.expected_error_mm[i] = 1 + static_cast<double>(i);
        points.status = {DEFREC_POINT_EXTRAPOLATED, DEFREC_POINT_OBSERVED,
                         DEFREC_POINT_EXTRAPOLATED, DEFREC_POINT_UNKNOWN,
                         DEFREC_POINT_EXTRAPOLATED, DEFREC_POINT_EXTRAPOLATED,
                         DEFREC_POINT_UNKNOWN};
        frame.points = &points;
        frame.rows.resize(4);
        frame.rows[0].status = PointStatus::kExtrapolated;
        frame.rows[0].xyz[2] = 90;
        frame.rows[0].expected_error_mm = 0.5;
        frame.rows[0].target = "tumour centre";
        frame.rows[1].id = 1;
        frame.rows[2].part = "organ";
        frame.rows[3].part = "vessel";
        frame.rows[3].id = 1;
    }
};

}  // namespace

TEST_CASE("pictures get every vertex with its status, and parts and targets by themselves") {
    const Example example;
    PlanEstimate plan;
    fill_plan(example.model, example.frame, plan);
    CHECK(plan.model == example.model);
    CHECK(plan.vertices.size() == 15);
    CHECK(plan.status.size() == 5);
    CHECK(plan.status[3] == VertexStatus::unknown);
    CHECK(plan.expected_error_mm[4] == 5);
    REQUIRE(plan.parts.size() == 2);
    CHECK(plan.parts[1].name == "vessel");
    REQUIRE(plan.targets.size() == 2);
    CHECK(plan.targets[0].xyz[2] == 90);
    CHECK(plan.targets[0].name == "tumour centre");
    CHECK(plan.targets[1].name.empty());
    CHECK(plan.targets[1].status == VertexStatus::unknown);

    PlanFrame lost = example.frame;
    lost.points = nullptr;
    fill_plan(example.model, lost, plan);
    CHECK(plan.vertices.empty());
    CHECK(plan.status.empty());
    CHECK(plan.parts.size() == 2);
}

TEST_CASE("a part with some known vertices is partly known, with their share") {
    Example example;
    example.points.uv.resize(2 * example.points.status.size());
    PartlyKnown known;
    CHECK(known.share() == 0);
    known.add(nullptr, {0, 3});
    known.add(&example.points, {1, 2, 4});  // all are known
    known.add(&example.points, {3});        // none is
    CHECK(known.share() == 0);
    CHECK(known.known_share() == 0);
    known.add(&example.points, {0, 1, 2, 3});
    CHECK(known.share() == 0.25);
    CHECK(known.known_share() == 0.75);
}

TEST_CASE("receivers get the triangles without an unknown corner, and targets that are not lost") {
    const Example example;
    const LinkPlan plan = link_plan(*example.model, example.frame);
    REQUIRE(plan.parts.size() == 1);  // the vessel has an unknown corner
    const LinkPart& organ = plan.parts[0];
    CHECK(organ.name == "organ");
    CHECK(organ.triangles == std::vector<std::uint32_t>{0, 1, 2, 1, 2, 3});
    REQUIRE(organ.status.size() == 4);
    CHECK(organ.status[1] == DEFREC_POINT_OBSERVED);
    CHECK(organ.expected_error_mm == std::vector<float>{1, 2, 3, 5});
    REQUIRE(organ.vertices.size() == 12);
    CHECK(organ.vertices[9] == 22);  // the model's fifth
    REQUIRE(plan.targets.size() == 1);
    CHECK(plan.targets[0].expected_error_mm == 0.5);
    CHECK(plan.targets[0].name == "tumour centre");

    PlanFrame lost = example.frame;
    lost.points = nullptr;
    CHECK(link_plan(*example.model, lost).parts.empty());
    CHECK(link_plan(*example.model, lost).targets.empty());
}

TEST_CASE("a file that is no plan is told from one that cannot be read") {
    const TestFolder folder;
    const auto said = [](const std::string& path) {
        return refusal_of([&] { expect_plan_file(path); });
    };
    CHECK_SAYS(said(folder / "absent"), "cannot be opened: No such file");
    CHECK_SAYS(said(folder.write("short", "defr")), "cut short");
    CHECK_SAYS(said(folder.write("mesh.ply", "ply\nformat ascii 1.0\n")), "this is no plan");
    CHECK(said(folder.write("a.plan", "defrecP\n")) == "accepted");
}
