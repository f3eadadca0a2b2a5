// Rows at the time of display: nearer to where they will be, and what they keep.
#include "sdk/session/display_prediction.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "sdk/io/csv.hpp"
#include "sdk/io/test_folder.hpp"

using namespace defrec::cli;

namespace {

constexpr double kIntervalMs = 1000.0 / 30;
constexpr double kDelayMs = 2 * kIntervalMs;

double swing(double ms) { return 4 * std::sin(8e-3 * ms); }

FrameOutcome outcome(int frame, std::uint32_t state = DEFREC_TRACKING) {
    return {std::llround(frame * kIntervalMs * 1e6), state, 1};
}

template <class Row>
Row row_at(int frame, std::int64_t id) {
    Row row;
    row.frame = frame;
    row.timestamp_ms = frame * kIntervalMs;
    row.id = id;
    row.status = PointStatus::kExtrapolated;
    row.xyz[0] = 2 * static_cast<double>(id);
    row.xyz[1] = swing(row.timestamp_ms);
    row.xyz[2] = 80;
    row.expected_error_mm = 0.1;
    row.covariance[0] = row.covariance[3] = 0.002;
    row.covariance[5] = 0.006;
    return row;
}

// A projection needs a rig, and a rig a context.
struct Display {
    Display()
        : context(open_context({1, true, {}})),
          rig(defrec::cli::make_rig(context, calibration())),
          projection(rig),
          prediction(folder / "display.csv", kDelayMs, projection) {}

    static StereoCalibration calibration() {
        StereoCalibration made;
        made.width = 640;
        made.height = 480;
        made.left = made.right = {620, 620, 320, 240, {}, "a camera", "its distortion"};
        made.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
        made.translation = {-5, 0, 0};
        return made;
    }

    TestFolder folder;
    Context context;
    Rig rig;
    RawProjection projection;
    DisplayPrediction prediction;
};

}  // namespace

TEST_CASE("points, targets and a plan are where they will be, with errors that have grown") {
    Display display;
    std::vector<PointRow> points;
    std::vector<TargetRow> targets;
    PlanFrame plan;
    MovedPoints vertices;
    vertices.resize(2);
    constexpr int kLast = 60;
    for (int frame = 0; frame <= kLast; ++frame) {
        points = {row_at<PointRow>(frame, 3), row_at<PointRow>(frame, 7)};
        targets = {row_at<TargetRow>(frame, 1)};
        PlanRow part = row_at<PlanRow>(frame, 0);
        part.part = "organ";
        plan.rows = {row_at<PlanRow>(frame, 0), part};
        for (std::size_t i = 0; i < 2; ++i) {
            vertices.status[i] = DEFREC_POINT_EXTRAPOLATED;
            vertices.xyz[3 * i + 1] = swing(frame * kIntervalMs);
            vertices.xyz[3 * i + 2] = 80;
            vertices.expected_error_mm[i] = 0.2;
        }
        plan.points = &vertices;
        points = display.prediction.move(outcome(frame), points);
        targets = display.prediction.move(outcome(frame), targets);
        plan = display.prediction.move(outcome(frame), plan);
    }
    const double now = swing(kLast * kIntervalMs), shown = swing(kLast * kIntervalMs + kDelayMs);
    REQUIRE(std::abs(now - shown) > 0.2);
    for (const PositionRow* row : std::initializer_list<const PositionRow*>{
             &points[0], &points[1], &targets[0], &plan.rows[0], &plan.rows[1]}) {
        CHECK(std::abs(row->xyz[1] - shown) < 0.03);
        CHECK(row->status == PointStatus::kExtrapolated);
        CHECK(row->expected_error_mm >= 0.1);
        CHECK(std::sqrt(row->covariance[0] + row->covariance[3] + row->covariance[5]) ==
              doctest::Approx(row->expected_error_mm));
        CHECK(row->timestamp_ms == doctest::Approx(kLast * kIntervalMs));
    }
    CHECK(points[1].xyz[0] == doctest::Approx(14));
    REQUIRE(plan.points != nullptr);
    CHECK(std::abs(plan.points->xyz[4] - shown) < 0.03);
    display.prediction.commit();
    const std::string text = TestFolder::read(display.folder / "display.csv");
    CHECK(text.find("frame,timestamp_ms,display_ms,kind,id,part,target,x,y,z,u,v,status") == 0);
    CHECK(text.find("\n60,2000.000,2066.667,point,7,,,14.0000,") != std::string::npos);
    CHECK(text.find(",plan-part,0,organ,") != std::string::npos);
    CHECK(text.find(",learned\n") != std::string::npos);
}

TEST_CASE("a lost frame leaves its rows lost; points that come later are followed as well") {
    Display display;
    for (int frame = 0; frame < 30; ++frame)
        display.prediction.move(outcome(frame), std::vector<PointRow>{row_at<PointRow>(frame, 0)});
    PointRow lost = row_at<PointRow>(30, 0);
    lost.status = PointStatus::kLost;
    std::vector<PointRow> rows =
        display.prediction.move(outcome(30, DEFREC_LOST), std::vector<PointRow>{lost});
    CHECK(rows[0].status == PointStatus::kLost);
    for (int frame = 31; frame < 80; ++frame) {
        rows.clear();
        for (std::int64_t id = 0; id < 5; ++id) rows.push_back(row_at<PointRow>(frame, id));
        rows = display.prediction.move(outcome(frame), rows);
    }
    REQUIRE(rows.size() == 5);
    for (const PointRow& row : rows)
        CHECK(std::abs(row.xyz[1] - swing(79 * kIntervalMs + kDelayMs)) < 0.05);
    CHECK(rows[4].xyz[0] == doctest::Approx(8));
    CHECK(display.prediction.move(outcome(80), std::vector<TargetRow>{}).empty());
    CHECK(display.prediction.move(outcome(80), PlanFrame{}).points == nullptr);
}
