// Scores of targets against numbers worked out by hand.
#include "sdk/evaluation/score/target_score.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "sdk/evaluation/score/target_plots.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/io/test_refusal.hpp"

using namespace defrec::cli;

namespace {

// The surface moves by (1, 0, 0) as a whole, and in frame 2 one hidden point elsewhere. The target
// at 5 mm moves with it, that at 20 mm stays.
const std::string kSurface =
    "frame,id,x,y,z,visible\n"
    "0,0,0,0,80,1\n0,1,10,0,80,1\n0,2,0,10,80,1\n0,3,5,5,80,1\n"
    "1,0,1,0,80,1\n1,1,11,0,80,1\n1,2,1,10,80,1\n1,3,90,5,80,0\n";
const std::string kTruth =
    "frame,id,depth,x,y,z\n"
    "0,0,5,1,1,85\n0,1,20,1,1,100\n"
    "1,0,5,2,1,85\n1,1,20,1,1,100\n";
const std::string kTargets =
    "frame,timestamp_ms,id,depth,x,y,z,u,v,status,expected_error_mm\n"
    "0,0,0,5,1,1,85,1,1,tracked,0.5\n0,0,1,20,1,1,104,1,1,extrapolated,2\n"
    "1,33,0,5,2,1,86,1,1,tracked,0.5\n1,33,1,20,,,,,,lost,\n";

void write_all(const TestFolder& folder) {
    folder.write("truth.csv", kSurface);
    folder.write("truth_deep.csv", kTruth);
    folder.write("targets.csv", kTargets);
}

ScoredTargets rows_of(const TestFolder& folder, bool with_surface = true,
                      const FrameRange& range = {}) {
    return read_scored_targets(folder / "targets.csv", folder / "truth_deep.csv",
                               with_surface ? folder / "truth.csv" : std::string(), range);
}

std::string refusal(const TestFolder& folder) {
    return refusal_of([&] { rows_of(folder); });
}

ScoredTarget target_of(double depth, double error, double expected, const char* status) {
    ScoredTarget target;
    target.depth = depth;
    target.status = status;
    target.error_mm = error;
    target.expected_mm = expected;
    return target;
}

}  // namespace

TEST_CASE("a sentence says how far targets are off and how many are lost") {
    const TestFolder folder;
    write_all(folder);
    CHECK(target_verdict(target_score_of(rows_of(folder))) ==
          "Of the targets 25.0 % were lost; half of the others were within 1.00 mm of the truth, "
          "95 % within 3.70 mm.\n");
    ScoredTargets lost = rows_of(folder);
    for (ScoredTarget& target : lost.rows) target.error_mm.reset();
    CHECK(target_verdict(target_score_of(lost)) == "All targets were lost.\n");
}

TEST_CASE("targets are scored by depth, beside a rigid fit of the visible surface") {
    const TestFolder folder;
    write_all(folder);
    const TargetScore score = target_score_of(rows_of(folder));
    REQUIRE(score.depths.size() == 2);
    const DepthScore& shallow = score.depths[0];
    CHECK(shallow.name() == "5 mm");
    CHECK(shallow.rows == 2);
    CHECK(shallow.lost == 0);
    CHECK(shallow.all.errors.median == doctest::Approx(0.5));  // 0 and 1 mm
    CHECK(shallow.all.errors.max == doctest::Approx(1));
    CHECK(shallow.all.mean_expected_mm == doctest::Approx(0.5));
    CHECK(shallow.all.coverage.within[0] == 0.5);
    CHECK(shallow.all.coverage.within[1] == 1);
    CHECK(shallow.rigid.max == doctest::Approx(0));
    REQUIRE(shallow.statuses.size() == 1);
    CHECK(shallow.statuses[0].status == "tracked");

    const DepthScore& deep = score.depths[1];
    CHECK(deep.lost_share() == 0.5);
    CHECK(deep.all.errors.count == 1);
    CHECK(deep.all.errors.median == doctest::Approx(4));
    CHECK(deep.statuses[0].status == "extrapolated");
    CHECK(deep.rigid.count == 2);
    CHECK(deep.rigid.max == doctest::Approx(1));
    CHECK(score.all.rows == 4);
    CHECK(score.all.statuses.size() == 2);

    FrameRange second_only;
    second_only.first = 1;
    const TargetScore second = target_score_of(rows_of(folder, true, second_only));
    CHECK(second.all.rows == 2);
    CHECK(second.depths[1].rigid.median == doctest::Approx(1));  // still from the first frame
    CHECK(std::isnan(second.depths[1].all.errors.median));
    CHECK(target_score_of(rows_of(folder, false)).all.rigid.count == 0);
}

TEST_CASE("targets of the truth that were not followed are counted and not lost") {
    const TestFolder folder;
    write_all(folder);
    folder.write("truth_deep.csv", kTruth + "0,9,5,1,1,85\n1,9,5,1,1,85\n");
    const TargetScore before = target_score_of(rows_of(folder));
    CHECK(before.not_followed == 1);
    CHECK(target_json(before)["not_followed"] == 1);
    CHECK(before.all.rows == 4);
}

TEST_CASE("the table and the JSON of targets say the same") {
    const TestFolder folder;
    write_all(folder);
    const TargetScore score = target_score_of(rows_of(folder));
    const std::string table = target_table(score);
    CHECK(table.find("20 mm                               1      4.000      4.000      4.000      "
                     "2.000     0.00 %   100.00 %   100.00 %    50.00 %      0.500      0.950\n") !=
          std::string::npos);
    CHECK(table.find("\n  tracked ") != std::string::npos);
    const auto json = target_json(score);
    CHECK(json["depths"][1]["min_depth_mm"] == 20);
    CHECK(json["depths"][1]["lost_share"] == 0.5);
    CHECK(json["depths"][1]["statuses"]["extrapolated"]["mean_expected_mm"] == 2);
    CHECK(json["depths"][0]["all"]["expected_errors"]["within_1"] == 0.5);
    CHECK(json["all"]["rigid_fit"]["count"] == 4);
    const auto alone = target_json(target_score_of(rows_of(folder, false)));
    CHECK(alone["all"]["rigid_fit"]["median_mm"].is_null());
    CHECK(json_text(alone).find("nan") == std::string::npos);
}

TEST_CASE("many depths are scored in ranges") {
    ScoredTargets targets;
    for (int i = 0; i <= 30; ++i) targets.rows.push_back(target_of(i, i, 1, "tracked"));
    const TargetScore score = target_score_of(targets);
    REQUIRE(score.depths.size() == 7);
    CHECK(score.depths[0].name() == "0 to 5 mm");
    CHECK(score.depths[0].rows == 5);
    CHECK(score.depths[1].all.errors.median == 7);
    CHECK(score.depths[6].rows == 1);
}

TEST_CASE("limits of targets hold at each depth") {
    const TestFolder folder;
    write_all(folder);
    const TargetScore score = target_score_of(rows_of(folder));
    CHECK(exceeded(score, {4.0, 4.0, false}).empty());
    const auto messages = exceeded(score, {3.9, {}, false});
    REQUIRE(messages.size() == 1);
    CHECK(messages[0] ==
          "the median over targets 20 mm deep is 4.000 mm, asked were at most 3.900 mm");

    const ScoredTargets targets{std::vector<ScoredTarget>(100, target_of(10, 3, 1, "tracked")), {}};
    const auto judged = exceeded(target_score_of(targets), {{}, {}, true});
    REQUIRE(judged.size() == 1);
    CHECK(judged[0].find("of the 10 mm deep tracked points 0.00 % are within 1") == 0);

    FrameRange second_only;
    second_only.first = 1;
    CHECK(joined(exceeded(target_score_of(rows_of(folder, true, second_only)), {9.0, {}, false}))
              .find("20 mm deep is not to be had, all are lost") != std::string::npos);
}

TEST_CASE("files of targets that do not fit are refused with their line") {
    const TestFolder folder;
    write_all(folder);
    folder.write("truth_deep.csv", with(kTruth, "0,1,20,1,1,100", "0,1,,1,1,100"));
    CHECK(refusal(folder).find("truth_deep.csv:3: depth") != std::string::npos);
    folder.write("truth_deep.csv", "frame,id,x,y,z\n");
    CHECK(refusal(folder).find("no column 'depth'") != std::string::npos);
    folder.write("truth_deep.csv", "frame,id,depth,x,y,z\n");
    CHECK(refusal(folder).find("the truth holds no row") != std::string::npos);
    write_all(folder);
    folder.write("targets.csv", with(kTargets, "1,1,104", "1,1,nan"));
    CHECK(refusal(folder).find("targets.csv:3") != std::string::npos);
    std::filesystem::remove(folder / "targets.csv");
    CHECK(refusal(folder).find("targets.csv: there is no such file") != std::string::npos);
}

TEST_CASE("the plots of targets hold no number that is none") {
    const TestFolder folder;
    write_all(folder);
    for (const bool with_surface : {true, false}) {
        const std::string page = target_sections(target_score_of(rows_of(folder, with_surface)));
        CHECK(page.find("Targets: error over depth") != std::string::npos);
        CHECK(page.find("20 mm: median error 4.000 mm") != std::string::npos);
        CHECK(page.find("nan") == std::string::npos);
    }
    CHECK(target_sections(target_score_of({{ScoredTarget()}, {}})).empty());
    const std::string one =
        target_sections(target_score_of({{target_of(10, 0, 0, "tracked")}, {}}));
    CHECK(one.find("nan") == std::string::npos);
}
