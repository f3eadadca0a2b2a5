// Scores against numbers worked out by hand.
#include "sdk/evaluation/score/score.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "sdk/io/json_text.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"

using namespace defrec::cli;

namespace {

// Frame 0: ids 0, 1 visible, 2 hidden. Frame 1: id 0 lost, id 1 without a row. Frame 2: nothing
// visible.
const std::string kTruth =
    "frame,id,x,y,z,visible\n"
    "0,0,0,0,80,1\n0,1,10,0,80,1\n0,2,20,0,80,0\n"
    "1,0,0,0,80,1\n1,1,10,0,80,1\n1,2,20,0,80,1\n"
    "2,0,0,0,80,0\n2,1,10,0,80,0\n2,2,20,0,80,0\n";
const std::string kPoints =
    "frame,timestamp_ms,id,x,y,z,u,v,status,expected_error_mm\n"
    "0,0,0,0,0,81,1,1,tracked,0.1\n0,0,1,13,4,80,1,1,tracked,0.1\n0,0,2,20,2,80,1,1,extrapolated,0."
    "1\n"
    "1,33,0,,,,,,lost,\n1,33,2,20,0,83,1,1,extrapolated,0.1\n"
    "2,66,0,,,,,,lost,\n2,66,1,,,,,,lost,\n2,66,2,,,,,,lost,\n";
const std::string kFrames = "frame,state,reasons\n0,tracking,\n1,degraded,occluded\n2,lost,dark\n";

Score score_of(const TestFolder& folder, const FrameRange& range = {},
               Unfollowed unfollowed = Unfollowed::kLeftOut) {
    return score_of(read_scored_rows(folder.path(), folder / "truth.csv", range, unfollowed));
}

void write_all(const TestFolder& folder) {
    folder.write("truth.csv", kTruth);
    folder.write("points.csv", kPoints);
    folder.write("frames.csv", kFrames);
}

std::string refusal(const TestFolder& folder) {
    return refusal_of([&] { score_of(folder); });
}

}  // namespace

TEST_CASE("a status that is no UTF-8 does not keep JSON from being written") {
    const TestFolder folder;
    write_all(folder);
    folder.write("points.csv",
                 "frame,timestamp_ms,id,x,y,z,u,v,status,expected_error_mm\n"
                 "0,0,0,0,0,81,1,1,caf\xe9,0.1\n");
    CHECK(json_text(score_json(score_of(folder))).find("caf\xef\xbf\xbd") != std::string::npos);
}

TEST_CASE("the summary of a sample") {
    std::vector<double> errors;
    for (int i = 100; i >= 0; --i) errors.push_back(i);
    const ErrorSummary summary = summarise(errors);
    CHECK(summary.count == 101);
    CHECK(summary.median == 50);
    CHECK(summary.p95 == 95);
    CHECK(summary.max == 100);
    CHECK(summary.mean == doctest::Approx(50));
    CHECK(summary.rmse == doctest::Approx(std::sqrt(3350.0)));
    CHECK(summarise({1, 2}).median == 1.5);
    CHECK(std::isnan(summarise({}).median));
}

TEST_CASE("visible, hidden and lost points are told apart, and missing rows are lost") {
    const TestFolder folder;
    write_all(folder);
    const Score score = score_of(folder);
    CHECK(score.all.frames == 3);
    CHECK(score.frames_without_visible == 1);
    CHECK(score.all.visible_points == 5);
    CHECK(score.all.lost_visible == 2);
    CHECK(score.all.lost_share() == doctest::Approx(0.4));
    CHECK(score.all.visible.count == 3);  // 1, 5 and 3 mm
    CHECK(score.all.visible.median == doctest::Approx(3));
    CHECK(score.all.visible.max == doctest::Approx(5));
    CHECK(score.all.hidden.count == 1);
    CHECK(score.all.hidden.median == doctest::Approx(2));

    REQUIRE(score.states.size() == 3);
    CHECK(score.states[0].name == "tracking");
    CHECK(score.states[0].visible.median == doctest::Approx(3));
    CHECK(score.states[1].lost_share() == doctest::Approx(2.0 / 3));
    CHECK(score.states[2].lost_share() == 0);

    FrameRange first_only;
    first_only.last = 1;
    CHECK(score_of(folder, first_only).all.visible_points == 2);
}

TEST_CASE("points of the truth that were not followed are counted, and lost only where asked") {
    const TestFolder folder;
    write_all(folder);
    std::string more = kTruth;
    for (const char* frame : {"0", "1", "2"})
        for (const char* id : {"7", "8", "9"})
            more.append(frame).append(",").append(id) += ",0,0,90,1\n";
    folder.write("truth.csv", more);
    const Score score = score_of(folder), whole = score_of(folder, {}, Unfollowed::kLost);
    CHECK(score.not_followed == 3);
    CHECK(score_json(score)["not_followed"] == 3);
    CHECK(score.all.visible_points == 5);
    CHECK(score.all.lost_visible == 2);  // id 1 has rows in other frames
    CHECK(score.all.visibility.count == 9);
    REQUIRE_FALSE(score.notes.empty());
    CHECK(score.notes[0].find("points.csv lacks 3 of the 6 points") == 0);
    CHECK(whole.not_followed == 3);
    CHECK(whole.all.visible_points == 14);
    CHECK(whole.all.lost_visible == 11);
}

TEST_CASE("limits are held, and nothing visible to measure exceeds them") {
    const TestFolder folder;
    write_all(folder);
    const Score score = score_of(folder);
    CHECK(joined(exceeded(score, {})) == "");
    CHECK(joined(exceeded(score, {3.0, 5.0, false})) == "");
    CHECK(joined(exceeded(score, {2.9, {}, false}))
              .find("the median over visible points is 3.000 mm") == 0);
    CHECK(joined(exceeded(score, {{}, 4.0, false})).find("95th percentile") != std::string::npos);
    folder.write("points.csv", kPoints.substr(0, kPoints.find('\n') + 1));
    const Score empty = score_of(folder);
    CHECK(empty.all.lost_share() == 1);
    CHECK(joined(exceeded(empty, {1000.0, {}, false})) != "");
    CHECK(score_json(empty)["visible"]["median_mm"].is_null());
    CHECK(score_tables(empty).find("100.00 %") != std::string::npos);
    CHECK(score_verdict(empty) == "All visible points were lost.\n");
}

TEST_CASE("a sentence says the result before the tables") {
    const TestFolder folder;
    write_all(folder);
    Score score = score_of(folder);
    CHECK(score_verdict(score) ==
          "Of the visible points 40.0 % were lost; half of the others were within 3.00 mm of the "
          "truth, 95 % within 4.80 mm.\n");
    score.all.lost_visible = 0;
    score.all.visible.median = 0.0651;
    score.all.visible.p95 = 0.24;
    CHECK(score_verdict(score) ==
          "Half of the visible points were within 0.07 mm of the truth, 95 % within 0.24 mm; 0 % "
          "were lost.\n");
}

TEST_CASE("expected errors are judged for each status, over visible and hidden points") {
    const TestFolder folder;
    write_all(folder);
    // The errors are 1 and 5 mm of tracked points, 2 (hidden) and 3 mm of extrapolated ones.
    folder.write("points.csv",
                 with(with(kPoints, "2,80,1,1,extrapolated,0.1", "2,80,1,1,extrapolated,2"),
                      "13,4,80,1,1,tracked,0.1", "13,4,80,1,1,tracked,2"));
    const Score score = score_of(folder);
    REQUIRE(score.all.statuses.size() == 2);
    CHECK(score.all.statuses[0].status == "tracked");
    CHECK(score.all.statuses[0].coverage.within[2] == 0.5);  // ratios 10 and 2.5
    CHECK(score.all.statuses[0].coverage.within[1] == 0);
    CHECK(score.all.statuses[1].status == "extrapolated");
    CHECK(score.all.statuses[1].coverage.within[0] == 0.5);  // ratios 1 and 30
    CHECK(score.all.tracked.count == 2);
    CHECK(score.all.tracked.max == doctest::Approx(5));
    CHECK(score.all.tracked.off == 1);
    REQUIRE(score.states[1].statuses.size() == 1);
    CHECK(score.states[1].statuses[0].coverage.count == 1);
    const auto json = score_json(score);
    CHECK(json["expected_errors"]["extrapolated"]["within_1"] == 0.5);
    CHECK(json["expected_errors"]["all"]["count"] == 4);
    // Errors 1 and 3 with 0.1, 2 and 5 with 2. What is left: 11, 10, 8, 8 by expected and 11, 8,
    // 6, 4 by true error, over 11.
    CHECK(json["expected_errors"]["all"]["ause"] == doctest::Approx(2.0 / 11));
    CHECK(json["tracked"]["off_by_more_than_2_mm"] == 1);
    CHECK(score_tables(score).find("1 of 2 tracked points is off by more than 2 mm, the worst by "
                                   "5.000 mm") != std::string::npos);
    CHECK(joined(exceeded(score, {{}, {}, true})).find("no status has 100 points") == 0);

    folder.write("points.csv", with(kPoints, "13,4,80,1,1,tracked,0.1", "13,4,80,1,1,tracked,"));
    CHECK(score_of(folder).all.statuses[0].coverage.without_expected == 1);
    folder.write("points.csv", with(kPoints, "13,4,80,1,1,tracked,0.1", "13,4,80,1,1,tracked,-1"));
    CHECK(refusal(folder).find("points.csv:3: -1 is negative") != std::string::npos);
}

TEST_CASE("tracked points are those said to be visible, and pixels need the camera") {
    const TestFolder folder;
    write_all(folder);
    const Score without = score_of(folder);
    // The first two of 5 visible rows are tracked, 1 and 5 mm off; the other 4 rows are hidden.
    CHECK(without.all.visibility.count == 9);
    CHECK(without.all.visibility.occlusion_accuracy == doctest::Approx(6.0 / 9));
    CHECK(without.all.visibility.mm.at[1] == doctest::Approx(1.0 / 6));
    CHECK(without.all.visibility.mm.at[2] == doctest::Approx(2.0 / 5));
    CHECK_FALSE(without.all.visibility.px);

    folder.write("summary.json", R"({"rectified_camera": {"fx": 400, "fy": 200, "cx": 3}})");
    const auto rows = read_scored_rows(folder.path(), folder / "truth.csv", {}).rows;
    CHECK(rows[0].error_px == doctest::Approx(0));
    CHECK(rows[1].error_px == doctest::Approx(std::hypot(15.0, 10.0)));  // 18.03
    CHECK_FALSE(rows[3].error_px);
    const Score score = score_of(folder);
    CHECK(score.all.visibility.px->at[3] == doctest::Approx(1.0 / 6));
    CHECK(score.all.visibility.px->at[4] == doctest::Approx(2.0 / 5));
    CHECK(score_json(score)["states"]["tracking"]["visibility"]["jaccard_px"]["32"] == 1);
    CHECK(score_tables(score).find("occlusion accuracy 66.67 % of 9 points") != std::string::npos);

    folder.write("points.csv", with(kPoints, "13,4,80", "13,4,-80"));
    CHECK(std::isinf(*read_scored_rows(folder.path(), folder / "truth.csv", {}).rows[1].error_px));
    folder.write("summary.json", R"({"rectified_camera": {"fx": 400}})");
    CHECK(refusal(folder).find("summary.json: a number rectified_camera/fy was expected") !=
          std::string::npos);
}

TEST_CASE("files that do not fit are refused with their line") {
    const TestFolder folder;
    write_all(folder);
    folder.write("points.csv", kPoints + "1,33,2,1,2,3,1,1,tracked,0.1\n");
    CHECK(refusal(folder).find("points.csv:10: frame 1, id 2 stands here again") !=
          std::string::npos);
    folder.write("points.csv", with(kPoints, "0,0,81", "0,nan,81"));
    CHECK(refusal(folder).find("points.csv:2") != std::string::npos);
    write_all(folder);
    folder.write("truth.csv", "frame,id,x,y,z,visible\n0,0,0,0,80,2\n");
    CHECK(refusal(folder).find("truth.csv:2: visible") != std::string::npos);
    std::filesystem::remove(folder / "points.csv");
    CHECK(refusal(folder).find("points.csv: there is no such file") != std::string::npos);
}

TEST_CASE("row 95: a header without end and states without number are refused") {
    const TestFolder folder;
    write_all(folder);
    folder.write("points.csv", std::string(1'000'000, 'x') + "\n");
    CHECK(refusal(folder).find("points.csv:1: the header has 1000000 bytes") != std::string::npos);
    folder.write("points.csv", std::string(5000, ',') + "\n");
    CHECK(refusal(folder).find("points.csv:1: the header has 5000 bytes") != std::string::npos);
    write_all(folder);
    std::string states = "frame,state\n";
    for (int i = 0; i < 65; ++i) states += std::to_string(i) + ",state" + std::to_string(i) + "\n";
    folder.write("frames.csv", states);
    CHECK(refusal(folder).find("more than 64 states") != std::string::npos);
}
