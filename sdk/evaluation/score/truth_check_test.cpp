// A truth of other points or of another sequence is told; a tracker that is wrong is not taken for
// one.
#include "sdk/evaluation/score/truth_check.hpp"

#include <doctest/doctest.h>

#include <nlohmann/json.hpp>

#include "sdk/evaluation/score/score.hpp"
#include "sdk/evaluation/score/score_report.hpp"
#include "sdk/evaluation/score/scored_targets.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/test_folder.hpp"

using namespace defrec::cli;

namespace {

using Notes = std::vector<std::string>;

// Points 0 to `count` - 1 in frames 0 and 1, 10 mm apart. `off` mm: how far they are from there.
struct Tracked {
    TrackedPositions positions;

    explicit Tracked(int count, double off = 0.1) {
        for (int frame = 0; frame < 2; ++frame)
            for (int id = 0; id < count; ++id) place(frame, id, off);
    }

    void place(int frame, int id, double off) {
        positions[{frame, id}] = TrackedPosition{{10.0 * id, off, 80}, "tracked", 0.1};
    }
};

Notes notes_of(const Tracked& tracked, int ids, int frames, int first_id = 0,
               Unfollowed unfollowed = Unfollowed::kLeftOut) {
    TruthCheck check(tracked.positions, "point", unfollowed);
    for (int frame = 0; frame < frames; ++frame)
        for (int id = first_id; id < first_id + ids; ++id)
            check.add({frame, id}, {10.0 * id, 0, 80}, true, true);
    return check.notes("truth.csv", "points.csv");
}

}  // namespace

TEST_CASE("a truth that fits leaves no note") { CHECK(notes_of(Tracked(8), 8, 2).empty()); }

TEST_CASE("a truth of other points is told by its ids") {
    CHECK(notes_of(Tracked(8), 4, 2, 100) ==
          Notes{"no id of truth.csv is in points.csv: is it the truth of other points?"});
    CHECK(
        notes_of(Tracked(8), 8, 2, 3) ==
        Notes{"points.csv lacks 3 of the 8 points of truth.csv (the first is id 8), which are not "
              "measured.",
              "truth.csv lacks 3 of the 8 points of points.csv, which are not measured."});
    CHECK(
        notes_of(Tracked(8), 8, 2, 3, Unfollowed::kLost) ==
        Notes{"points.csv lacks 3 of the 8 points of truth.csv (the first is id 8), which count as "
              "lost.",
              "truth.csv lacks 3 of the 8 points of points.csv, which are not measured."});
    CHECK(notes_of(Tracked(8), 7, 2) ==
          Notes{"truth.csv lacks 1 of the 8 points of points.csv, which are not measured."});
}

TEST_CASE("frames that the truth or the tracked points lack are told") {
    CHECK(
        notes_of(Tracked(8), 8, 5) ==
        Notes{
            "points.csv lacks 3 of the 5 frames of truth.csv (the first is 2), whose points count "
            "as lost. --frames A:B leaves them out."});
    CHECK(
        notes_of(Tracked(8), 8, 1) ==
        Notes{"truth.csv lacks 1 of the 2 frames of points.csv, which are not measured: is it the "
              "truth of another sequence?"});
}

TEST_CASE("frames that either lacks are told of both") {
    const Tracked tracked(8);
    TruthCheck check(tracked.positions, "point", Unfollowed::kLeftOut);
    for (const int frame : {1, 2, 3})
        for (int id = 0; id < 8; ++id) check.add({frame, id}, {10.0 * id, 0, 80}, true, true);
    check.finish();
    const Notes notes = check.notes("truth.csv", "points.csv");
    REQUIRE(notes.size() == 2);
    CHECK(notes[0].find("points.csv lacks 2 of the 3 frames of truth.csv (the first is 2)") == 0);
    CHECK(notes[1].find("truth.csv lacks 1 of the 2 frames of points.csv") == 0);
}

TEST_CASE("a truth in another unit is told by its scale") {
    const auto question_of = [](double per_mm) {
        const Tracked tracked(8);
        TruthCheck check(tracked.positions, "point", Unfollowed::kLeftOut);
        for (int id = 0; id < 8; ++id)
            check.add({0, id}, {10.0 * id * per_mm, 0, 80 * per_mm}, true, true);
        return check.doubt("truth.csv", "points.csv").note;
    };
    CHECK(question_of(0.001).find("truth.csv seems to be in metres, and mm are expected.") !=
          std::string::npos);
    CHECK(question_of(0.1).find("seems to be in centimetres") != std::string::npos);
    CHECK(question_of(1000).find("seems to be in micrometres") != std::string::npos);
    CHECK(question_of(0.5).find("or in another unit?") != std::string::npos);
}

TEST_CASE("a row of the truth that stands twice is refused with its line") {
    const TestFolder folder;
    folder.write("points.csv", "frame,id,x,y,z,status,expected_error_mm\n0,1,0,0,80,tracked,0.1\n");
    folder.write("truth.csv", "frame,id,x,y,z,visible\n0,1,0,0,80,1\n0,2,0,0,80,1\n0,1,0,0,80,1\n");
    folder.write("deep.csv", "frame,id,depth,x,y,z\n0,1,5,0,0,80\n0,1,5,0,0,80\n");
    CHECK_THROWS_WITH_AS(read_scored_rows(folder.path(), folder / "truth.csv", {}),
                         (folder / "truth.csv:4: frame 0, id 1 stands here again.").c_str(),
                         CliError);
    CHECK_THROWS_WITH_AS(read_scored_targets(folder / "points.csv", folder / "deep.csv", {}, {}),
                         (folder / "deep.csv:3: frame 0, id 1 stands here again.").c_str(),
                         CliError);
}

TEST_CASE("frames that are asked for and not in the truth are named") {
    const TestFolder folder;
    folder.write("points.csv", "frame,id,x,y,z,status,expected_error_mm\n0,1,0,0,80,tracked,0.1\n");
    folder.write("truth.csv", "frame,id,x,y,z,visible\n0,1,0,0,80,1\n1,1,0,0,80,1\n");
    CHECK_THROWS_WITH_AS(read_scored_rows(folder.path(), folder / "truth.csv", {100, 200}),
                         (folder / "truth.csv: the truth has no row of frames 100 to 199, which "
                                   "--frames asks for; its frames are 0 to 1.")
                             .c_str(),
                         CliError);
}

TEST_CASE("a truth of another sequence is told by the first frame with positions") {
    Tracked tracked(8, 3);
    CHECK(notes_of(tracked, 8, 2) ==
          Notes{"in frame 0, the first with positions, 8 of 8 points are more than 5 expected "
                "errors away from the truth, half of these by 3.0 mm or more: is truth.csv the "
                "truth of another sequence, of other points, or in another unit? If not, the "
                "calibration may be of other cameras."});
    for (int id = 0; id < 8; ++id) tracked.positions[{0, id}].reset();
    CHECK(notes_of(tracked, 8, 2).front().find("in frame 1, ") == 0);
    CHECK(notes_of(Tracked(1, 3), 1, 2)
              .front()
              .find("1 of 1 point is more than 5 expected errors away from the truth, by 3.0 mm or "
                    "more: is") != std::string::npos);
}

TEST_CASE("a truth that cannot be of what was tracked is told from one that may be") {
    const auto doubt_of = [](const Tracked& tracked, int first_id, int first_frame) {
        TruthCheck check(tracked.positions, "point", Unfollowed::kLeftOut);
        for (int id = first_id; id < first_id + 8; ++id)
            check.add({first_frame, id}, {10.0 * id, 0, 80}, true, true);
        return check.doubt("truth.csv", "points.csv");
    };
    CHECK(doubt_of(Tracked(8), 0, 0).note.empty());
    CHECK(doubt_of(Tracked(8), 4, 0).note.empty());
    CHECK(doubt_of(Tracked(8), 8, 0).is_certain);
    CHECK(doubt_of(Tracked(8), 0, 2).note ==
          "no frame of truth.csv (2) is in points.csv (0 to 1).");
    CHECK(doubt_of(Tracked(8), 0, 2).is_certain);
    const TruthDoubt far = doubt_of(Tracked(8, 3), 0, 0);
    CHECK(far.note.find("in frame 0, ") == 0);
    CHECK_FALSE(far.is_certain);
    CHECK(doubt_of(Tracked(0), 0, 0).note.empty());  // nothing was tracked
}

TEST_CASE("a tracker that is wrong is not taken for a wrong truth") {
    Tracked drifts(8);
    for (int id = 0; id < 8; ++id) drifts.place(1, id, 30);
    CHECK(notes_of(drifts, 8, 2).empty());

    Tracked some(12);  // a quarter is not more than a quarter
    for (const int id : {0, 1, 2}) some.place(0, id, 30);
    CHECK(notes_of(some, 12, 2).empty());
    some.place(0, 3, 30);
    CHECK(notes_of(some, 12, 2).size() == 1);

    Tracked few(4);  // of which two are far
    for (const int id : {0, 1}) few.place(0, id, 30);
    CHECK(notes_of(few, 4, 2).empty());
    CHECK(notes_of(Tracked(1, 30), 1, 2).size() == 1);
    CHECK(notes_of(Tracked(8, 0.5), 8, 2).empty());  // 5 expected errors
    CHECK(notes_of(Tracked(8, 0.51), 8, 2).size() == 1);
}

TEST_CASE("what the truth says is hidden is not compared, frames not asked for are") {
    const Tracked tracked(8, 30);
    constexpr auto kLeftOut = Unfollowed::kLeftOut;
    TruthCheck hidden(tracked.positions, "target", kLeftOut),
        first(tracked.positions, "target", kLeftOut);
    for (int id = 0; id < 8; ++id) {
        hidden.add({0, id}, {10.0 * id, 0, 80}, false, true);
        hidden.add({1, id}, {10.0 * id, 0, 80}, false, true);
        first.add({0, id}, {10.0 * id, 0, 80}, true, false);
        first.add({1, id}, {10.0 * id, 0, 80}, true, true);
    }
    CHECK(hidden.notes("t", "p").empty());
    CHECK(first.notes("t", "p").size() == 1);
}

TEST_CASE("notes on the truth are in the JSON and on the page of a score") {
    const TestFolder folder;
    folder.write("truth.csv", "frame,id,x,y,z,visible\n0,7,0,0,80,1\n");
    folder.write("points.csv", "frame,id,x,y,z,status,expected_error_mm\n0,1,0,0,80,tracked,0.1\n");
    Scores scores;
    scores.points = score_of(read_scored_rows(folder.path(), folder / "truth.csv", {}));
    CHECK(scores.points->doubt.is_certain);
    CHECK(score_json(*scores.points)["notes"].size() == 1);
    CHECK(score_json(*scores.points)["is_truth_in_doubt"] == true);
    CHECK(score_page(scores, "tracked", "truth.csv").find("is it the truth of other points?") !=
          std::string::npos);
}
