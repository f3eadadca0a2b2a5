// Points that are followed, and no longer.
#include "sdk/session/point_follower.hpp"

#include <doctest/doctest.h>

#include <algorithm>

#include "sdk/io/test_folder.hpp"
#include "sdk/testing/plane_tracker.hpp"

using namespace defrec::cli;
using defrec::test::PlaneTracker;

namespace {

Rig rig_of_scene(const Context& context) {
    const defrec_rig_desc desc = defrec::test::scene_rig();
    defrec_rig rig = nullptr;
    REQUIRE_OK(defrec_rig_create(context.get(), &desc, &rig));
    return Rig(rig);
}

const PointRow& row_of(const std::vector<PointRow>& rows, std::int64_t id) {
    const auto found =
        std::find_if(rows.begin(), rows.end(), [&](const PointRow& row) { return row.id == id; });
    REQUIRE(found != rows.end());
    return *found;
}

}  // namespace

TEST_CASE("a point that is removed is followed no longer, and its id is not given again") {
    const TestFolder folder;
    const Context context = open_context({1, true, {}});
    const Rig rig = rig_of_scene(context);
    RawProjection projection(rig);
    PointFollower points(folder / "points.csv", {{1, 100, 80, 0}, {2, 160, 120, 0}}, rig,
                         projection);
    PlaneTracker tracker;
    const defrec_job job = tracker.track(0.5, 0);
    CHECK(points.follow(200, 150, 0) == 3);
    CHECK(points.follow(120, 100, 0) == 4);
    const std::vector<PointRow> before = points.add_frame(0, 0, job);
    CHECK(before.size() == 4);
    CHECK(points.count_on_surface() == 4);
    points.remove(2);
    points.remove(2);
    points.remove(4);
    CHECK(points.count_on_surface() == 2);
    CHECK(points.count() == 4);
    const std::vector<PointRow> after = points.add_frame(1, 33, job);
    CHECK(after.size() == 2);
    for (const std::int64_t id : {1, 3}) {
        CHECK(row_of(after, id).status == PointStatus::kTracked);
        for (int axis = 0; axis < 3; ++axis)
            CHECK(row_of(after, id).xyz[axis] == row_of(before, id).xyz[axis]);
        CHECK(row_of(after, id).piece == row_of(before, id).piece);
    }
    CHECK(points.follow(140, 110, 2) == 5);
    CHECK(points.add_frame(2, 66, job).size() == 3);
    CHECK(points.count_on_surface() == 3);
    points.commit();
    const std::string text = TestFolder::read(folder / "points.csv");
    CHECK(std::count(text.begin(), text.end(), '\n') == 1 + 4 + 2 + 3);
    defrec_job_release(job);
}
