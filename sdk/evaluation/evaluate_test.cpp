// The whole command on rendered sequences: scores, shards, resumption and quarantine.
#include "sdk/evaluation/evaluate.hpp"

#include <doctest/doctest.h>
#include <signal.h>

#include "sdk/evaluation/clip_store.hpp"
#include "sdk/evaluation/program_run.hpp"
#include "sdk/evaluation/score/score.hpp"
#include "sdk/evaluation/score/target_score.hpp"
#include "sdk/io/csv.hpp"
#include "sdk/io/text.hpp"
#include "sdk/scenes/writing/test_sequence.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;

namespace {

const auto& start = start_evaluate;
const auto& run = run_evaluate_program;

// The true points of the sequence, as targets at the depth of their number's last digit, mm.
void add_targets(const TestFolder& folder, const fs::path& clip) {
    std::string targets = "id,x,y,z,depth\n", truth = "frame,id,x,y,z,depth\n";
    CsvReader points(rendered_sequence<4>().path() / "truth.csv", {"frame", "id", "x", "y", "z"});
    while (points.next()) {
        std::string row(points.field(1));
        for (std::size_t column = 2; column < 5; ++column)
            row.append(",").append(points.field(column));
        row.append(",").append(std::to_string(points.integer(1) % 10)).append("\n");
        if (points.integer(0) == 0) targets += row;
        truth.append(points.field(0)).append(",").append(row);
    }
    folder.write((clip / "targets.csv").string(), targets);
    folder.write((clip / kDeepTruthFile).string(), truth);
}

// Clips one, which has targets, two and deep/three of the same frames with points of their own.
const TestFolder& data_set() {
    static const TestFolder folder;
    static const bool is_made = [] {
        const TestFolder& sequence = rendered_sequence<4>();
        std::size_t clip_number = 0;
        for (const char* clip : {"one", "two", "deep/three"}) {
            const fs::path to = folder.path() / clip;
            fs::create_directories(to);
            for (const char* name : {"left", "right", "calibration.yaml", "truth.csv"})
                fs::create_symlink(sequence.path() / name, to / name);
            // Every third point, beginning with another.
            CsvReader points(sequence.path() / "points.csv", {"id", "u", "v"});
            std::string text = "id,u,v\n";
            for (std::size_t i = clip_number++; points.next(); ++i)
                if (i % 3 == 0)
                    text.append(points.field(0))
                        .append(",")
                        .append(points.field(1))
                        .append(",")
                        .append(points.field(2))
                        .append("\n");
            folder.write((fs::path(clip) / "points.csv").string(), text);
        }
        add_targets(folder, "one");
        return true;
    }();
    static_cast<void>(is_made);
    return folder;
}

std::vector<std::string> with_out(const fs::path& out, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"--dataset", "defrec",     data_set().path().string(),
                                       "--out",     out.string(), "--backend",
                                       "cpu",       "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
}

// The files that are the same from run to run.
std::map<std::string, std::string> merged(const fs::path& out) {
    std::map<std::string, std::string> files;
    for (const char* name : {"results.csv", "summary.csv", "results_by_depth.csv",
                             "summary_by_depth.csv", "evaluation.html"})
        files[name] = TestFolder::read(out / name);
    return files;
}

// A whole evaluation of the three clips.
const TestFolder& evaluated() {
    static const TestFolder folder;
    static const int code = run(with_out(folder.path()));
    REQUIRE(code == 0);
    return folder;
}

}  // namespace

TEST_CASE("a clip's metrics are the score of its points") {
    const TestFolder& out = evaluated();
    const fs::path clip = ClipStore(out.path()).folder({"defrec", "deep/three"});
    const ScoreGroup score =
        score_of(read_scored_rows(clip, data_set() / "deep/three/truth.csv", {}, Unfollowed::kLost))
            .all;
    CsvReader results(out.path() / "results.csv", {"clip", "status", "median_mm", "p95_mm",
                                                   "lost_share", "average_jaccard_px"});
    std::vector<std::string> clips;
    while (results.next()) {
        clips.emplace_back(results.field(0));
        CHECK(results.field(1) == "done");
        if (clips.back() != "deep/three") continue;
        CHECK(results.number(2) == score.visible.median);
        CHECK(results.number(3) == score.visible.p95);
        CHECK(results.number(4) == score.lost_share());
        CHECK(results.number(5) == score.visibility.px->average);
    }
    CHECK(clips == std::vector<std::string>{"deep/three", "one", "two"});
    CHECK(fs::exists(clip / kPictureFile));
    CHECK_FALSE(fs::exists(clip / "report.html"));
}

TEST_CASE("targets are scored by depth, and are in no metric of points") {
    const TestFolder& out = evaluated();
    const fs::path clip = ClipStore(out.path()).folder({"defrec", "one"});
    const fs::path given = data_set().path() / "one";
    const TargetScore score = target_score_of(read_scored_targets(
        clip / "targets.csv", given / kDeepTruthFile, given / "truth.csv", {}, Unfollowed::kLost));
    REQUIRE(score.depths.size() == 10);
    CsvReader results(out.path() / "results_by_depth.csv",
                      {"clip", "depth", "points", "median_mm", "lost_share", "rigid_p95_mm"});
    std::size_t depth = 0;
    for (; results.next(); ++depth) {
        REQUIRE(depth < score.depths.size());
        const DepthScore& expected = score.depths[depth];
        CHECK(results.field(0) == "one");
        CHECK(results.field(1) == expected.name());
        CHECK(results.number(2) == static_cast<double>(expected.rows));
        CHECK(results.number(3) == expected.all.errors.median);
        CHECK(results.number(4) == expected.lost_share());
        CHECK(results.number(5) == expected.rigid.p95);
    }
    CHECK(depth == 10);
    const ScoreGroup points =
        score_of(read_scored_rows(clip, given / "truth.csv", {}, Unfollowed::kLost)).all;
    CsvReader all(out.path() / "results.csv", {"clip", "median_mm"});
    while (all.next())
        if (all.field(0) == "one") CHECK(all.number(1) == points.visible.median);
    CHECK(TestFolder::read(out / "evaluation.html").find("<h2>Targets by depth</h2>") !=
          std::string::npos);
}

TEST_CASE("shards in any order, and a run that was killed and resumed, give the same bytes") {
    const auto expected = merged(evaluated().path());
    const TestFolder shards;
    for (const char* shard : {"3/3", "1/3"})
        REQUIRE(run(with_out(shards.path(), {"--shard", shard})) == 0);
    CHECK_FALSE(fs::exists(shards / "results.csv"));
    CHECK(run(with_out(shards.path(), {"--merge"})) == 3);  // one is missing
    REQUIRE(run(with_out(shards.path(), {"--shard", "2/3"})) == 0);
    REQUIRE(run(with_out(shards.path(), {"--merge"})) == 0);
    CHECK(merged(shards.path()) == expected);

    const TestFolder killed;
    const ClipStore store(killed.path());
    const pid_t child = start(with_out(killed.path(), {"--jobs", "2"}));
    while (!store.outcome({"defrec", "deep/three"}) && !store.outcome({"defrec", "one"}))
        ::usleep(1000);
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    REQUIRE(run(with_out(killed.path(), {"--resume"})) == 0);
    CHECK(merged(killed.path()) == expected);
}

TEST_CASE("what is done with the same options is kept, and what is not is run") {
    const TestFolder out;
    REQUIRE(run(with_out(out.path(), {"--subset", "t*"})) == 0);
    const std::string mark = (ClipStore(out.path()).folder({"defrec", "two"}) / "mark").string();
    const auto marked_after = [&](const std::vector<std::string>& more) {
        std::ofstream(mark).put('x');
        std::vector<std::string> arguments{"--subset", "two", "--resume"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        CHECK(run(with_out(out.path(), arguments)) == 0);
        return fs::exists(mark);
    };
    CHECK(marked_after({}));
    CHECK_FALSE(marked_after({"--seed", "5"}));
    CHECK(run(with_out(out.path(), {"--subset", "two", "--merge"})) == 3);
    CHECK(run(with_out(out.path(), {"--subset", "four*"})) == 2);
}

TEST_CASE("results of other data are run again, and not merged") {
    const TestFolder first, second, out;
    const fs::path one = data_set().path() / "one", two = data_set().path() / "two";
    fs::copy(one, first.path() / "clip", fs::copy_options::recursive);
    fs::copy(one, second.path() / "clip", fs::copy_options::recursive);
    const std::string mark = (ClipStore(out.path()).folder({"defrec", "clip"}) / "mark").string();
    const auto evaluate = [&](const TestFolder& root, const char* how) {
        return run({"--dataset", "defrec", root.path().string(), "--out", out.path().string(),
                    "--backend", "cpu", "--quiet", how});
    };
    REQUIRE(evaluate(first, "--resume") == 0);
    std::ofstream(mark).put('x');
    CHECK(evaluate(second, "--resume") == 0);  // the same data elsewhere
    CHECK(fs::exists(mark));
    second.write("clip/points.csv", TestFolder::read(two / "points.csv"));
    CHECK(evaluate(second, "--merge") == 3);
    CHECK(evaluate(second, "--resume") == 0);
    CHECK_FALSE(fs::exists(mark));
    CHECK(evaluate(second, "--merge") == 0);
}

TEST_CASE("a clip with a file that is absent or cut is in quarantine, and the others are done") {
    const TestFolder root, out;
    for (const auto& entry : fs::directory_iterator(data_set().path() / "one")) {
        for (const char* clip : {"cut", "good", "lacks"}) {
            fs::create_directories(root.path() / clip);
            fs::create_symlink(entry.path(), root.path() / clip / entry.path().filename());
        }
    }
    fs::remove(root.path() / "lacks/points.csv");
    fs::remove(root.path() / "cut/left");
    fs::create_directory(root.path() / "cut/left");
    for (const fs::path& image : images_of(data_set().path() / "one/left")) {
        std::string bytes = TestFolder::read(image);
        if (image.stem() == "000002") bytes.resize(bytes.size() / 2);
        root.write((fs::path("cut/left") / image.filename()).string(), bytes);
    }
    CHECK(run({"--dataset", "defrec", root.path().string(), "--out", out.path().string(),
               "--backend", "cpu", "--quiet", "--jobs", "3"}) == 6);
    const auto reasons = reasons_of(out.path());
    CHECK(reasons.at("good").empty());
    CHECK(reasons.at("lacks").find("points.csv: this file was expected") != std::string::npos);
    CHECK(reasons.at("cut").find("000002.png: this is not a whole image") != std::string::npos);
    CHECK(TestFolder::read(out / "evaluation.html").find("In quarantine") != std::string::npos);
}

// The calibration with T in metres.
std::string in_metres(const std::string& text) {
    const std::size_t begin = text.find("data: [", text.find("\nT:")) + 7;
    const std::size_t end = text.find(',', begin);
    return text.substr(0, begin) + " " + exact(std::stod(text.substr(begin, end - begin)) / 1000) +
           text.substr(end);
}

// Clips of the sequence, each with a truth of its own.
class OtherTruths {
  public:
    // The rows of the truth, with their numbers of frame and lengths changed.
    void add(const std::string& clip, std::int64_t added, double factor) const {
        const TestFolder& sequence = rendered_sequence<4>();
        fs::create_directories(root_.path() / clip);
        for (const char* name : {"left", "right", "calibration.yaml", "points.csv"})
            fs::create_symlink(sequence.path() / name, root_.path() / clip / name);
        std::string text = "frame,id,x,y,z,visible\n";
        CsvReader rows(sequence.path() / "truth.csv", {"frame", "id", "x", "y", "z", "visible"});
        while (rows.next()) {
            const std::int64_t frame = rows.integer(0) + added;
            if (frame < 0) continue;
            text += std::to_string(frame) + "," + std::to_string(rows.integer(1));
            for (std::size_t column = 2; column < 5; ++column)
                text += "," + exact(rows.number(column) * factor);
            text += "," + std::to_string(rows.integer(5)) + "\n";
        }
        root_.write(clip + "/truth.csv", text);
    }
    const TestFolder& root() const { return root_; }
    int evaluate(const fs::path& out, const std::vector<std::string>& more = {}) const {
        std::vector<std::string> arguments{"--dataset", "defrec",     root_.path().string(),
                                           "--out",     out.string(), "--backend",
                                           "cpu",       "--quiet"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return run(arguments);
    }

  private:
    TestFolder root_;
};

TEST_CASE("a clip whose truth contradicts what was tracked is doubtful, and not among all") {
    const OtherTruths truths;
    truths.add("good", 0, 1);
    const TestFolder alone, out;
    REQUIRE(truths.evaluate(alone.path()) == 0);
    truths.add("metres", 0, 0.001);
    REQUIRE(truths.evaluate(out.path(), {"--method", "defrec", "--method", "still"}) == 6);
    std::map<std::string, std::string> status;
    CsvReader results(out.path() / "results.csv", {"variant", "clip", "status", "reason"});
    while (results.next()) {
        const std::string name =
            std::string(results.field(0)) + " " + std::string(results.field(1));
        status[name] = results.field(2);
        const bool is_doubtful = results.field(1) == "metres";
        CHECK(results.is_empty(3) == !is_doubtful);
        if (!is_doubtful) continue;
        const std::string reason(results.field(3));
        CHECK(reason.find(": truth.csv seems to be in metres; and mm are expected.") !=
              std::string::npos);
    }
    CHECK(status == std::map<std::string, std::string>{{"defrec good", "done"},
                                                       {"defrec metres", "doubtful"},
                                                       {"still good", "done"},
                                                       {"still metres", "doubtful"}});
    const auto median_in = [](const TestFolder& folder) {
        CsvReader summary(folder.path() / "summary.csv", {"median_mm"});
        REQUIRE(summary.next());
        return summary.number(0);
    };
    CHECK(median_in(out) == median_in(alone));
    CHECK(TestFolder::read(out / "evaluation.html").find("<p class=\"doubt\">") !=
          std::string::npos);
    CHECK(truths.evaluate(out.path(), {"--method", "defrec", "--method", "still", "--merge"}) == 6);
}

TEST_CASE("a truth with frames that the recording lacks is in quarantine, and its file named") {
    const OtherTruths truths;
    const TestFolder out;
    truths.add("late", 3, 1);
    REQUIRE(truths.evaluate(out.path()) == 6);
    const std::string reason = reasons_of(out.path()).at("late");
    INFO(reason);
    CHECK(reason.find("late/truth.csv: it asks for frame 4; and the recording has 4 frames; "
                      "counted from 0: ") != std::string::npos);
    CsvReader summary(out.path() / "summary.csv", {"median_mm", "lost_share"});
    REQUIRE(summary.next());
    CHECK(summary.is_empty(0));
    CHECK(summary.is_empty(1));
}

TEST_CASE("a calibration in metres is refused, and taken with --units m") {
    const OtherTruths truths;
    const TestFolder out;
    truths.add("clip", 0, 1);
    const std::string text = TestFolder::read(truths.root() / "clip/calibration.yaml");
    fs::remove(truths.root().path() / "clip/calibration.yaml");
    truths.root().write("clip/calibration.yaml", in_metres(text));
    REQUIRE(truths.evaluate(out.path()) == 6);
    CHECK(reasons_of(out.path()).at("clip").find("pass --units m.") != std::string::npos);
    CHECK(truths.evaluate(out.path(), {"--units", "m"}) == 0);
    CHECK(run({"--dataset", "stir", truths.root().path().string(), "--out", out.path().string(),
               "--units", "m"}) == 2);
}

TEST_CASE("files of an earlier evaluation are removed, and those of others are kept") {
    const TestFolder out;
    const std::string effects = out.write("effects.csv", "variant,metric,value\nold,x,1\n");
    REQUIRE(run(with_out(out.path(), {"--subset", "two"})) == 0);
    CHECK_FALSE(fs::exists(effects));
    REQUIRE(fs::exists(out / "summary.csv"));
    REQUIRE(run(with_out(out.path(), {"--subset", "two", "--shard", "1/1"})) == 0);
    CHECK_FALSE(fs::exists(out / "summary.csv"));  // what it was of is replaced
    const std::string mine = out.write("results.csv", "mine\n");
    CHECK(run(with_out(out.path(), {"--subset", "two"})) == 2);
    CHECK(run(with_out(out.path(), {"--subset", "two", "--merge"})) == 2);
    CHECK(TestFolder::read(mine) == "mine\n");
}

#ifdef DEFREC_FAULTY_PLUGINS
TEST_CASE("clips of a plugin that fails or hangs are in quarantine") {
    const auto reason_with = [](const char* plugin, const char* time_limit) {
        const TestFolder out;
        ::setenv("DEFREC_PLUGIN_PATH", DEFREC_FAULTY_PLUGINS, 1);
        const int code =
            run({"--dataset", "defrec", data_set().path().string(), "--out", out.path().string(),
                 "--subset", "one", "--backend", plugin, "--time-limit", time_limit, "--quiet"});
        ::unsetenv("DEFREC_PLUGIN_PATH");
        CHECK(code == 6);
        CsvReader results(out.path() / "results.csv", {"reason"});
        REQUIRE(results.next());
        return std::string(results.field(0));
    };
    CHECK(reason_with("crashes_in_enqueue", "600").find("ended by signal 11") != std::string::npos);
    CHECK(reason_with("hangs_in_wait", "3").find("no end within the time limit of 3 s") == 0);
}
#endif

TEST_CASE("parameters are variants, with a table of their effects") {
    const TestFolder out;
    const std::string few = out.write("few.yaml", "max_patches: 64\n");
    const std::string same = out.write("same.yaml", "seed: 0\n");
    CHECK(run(with_out(out.path(), {"--config", same})) == 2);
    const std::string many = out.write("many.yaml", "max_patches: 1024\n");
    REQUIRE(run(with_out(out.path() / "out",
                         {"--subset", "one", "--config", many, "--config", few})) == 0);
    CsvReader effects(out.path() / "out/effects.csv",
                      {"variant", "metric", "value", "first", "change"});
    std::size_t rows = 0, changed = 0;
    while (effects.next()) {
        ++rows;
        // Nothing is hidden in these frames.
        if (effects.field(0) == "many" && effects.field(1) != "hidden_p95_mm")
            CHECK(effects.field(4) == "0");
        changed +=
            effects.field(0) == "few" && effects.field(1) == "median_mm" && effects.number(4) != 0;
    }
    CHECK(rows == 2 * 13);
    CHECK(changed == 1);
}

TEST_CASE("clips are named by their folders under the root, also where these are links") {
    const TestFolder root, elsewhere;
    fs::create_directories(root / "deep/er");
    fs::create_directory(root / ".hidden");
    for (const std::string link : {"b10", "b9", "deep/er/c", ".hidden/d"}) {
        const std::string clip = fs::path(link).filename().string();
        fs::create_directory(elsewhere / clip);
        elsewhere.write(clip + "/truth.csv", "");
        fs::create_directory_symlink(elsewhere / clip, root.path() / link);
    }
    const std::vector<std::string> expected{"b9", "b10", "deep/er/c"};
    const DataSet& sequences = data_set_of("defrec");
    CHECK(clips_of(sequences, root.path()) == expected);
    CHECK(clips_of(sequences, root / "") == expected);
    CHECK(clips_of(sequences, root.path() / "b9") == std::vector<std::string>{"."});
    CHECK(clips_of(sequences, root / "deep/er/c/") == std::vector<std::string>{"."});
}

TEST_CASE("row 122: each real folder is listed once, whatever links lead to it or nowhere") {
    const TestFolder root;
    for (const char* clip : {"a", "b", "deep/c"}) {
        fs::create_directories(root / clip);
        root.write(std::string(clip) + "/truth.csv", "");
    }
    fs::create_directory_symlink(".", root / "0_itself");
    fs::create_directory_symlink("../deep", root / "deep/above");
    fs::create_directory_symlink("b", root / "0_b");
    fs::create_symlink("nowhere", root / "dangling");
    CHECK(clips_of(data_set_of("defrec"), root.path()) ==
          std::vector<std::string>{"a", "b", "deep/c"});
}

TEST_CASE("what cannot be evaluated is said before anything is run") {
    const TestFolder empty;
    const std::string out = empty / "out";
    CHECK(run({"--dataset", "nothing", empty.path().string(), "--out", out}) == 2);
    CHECK(run({"--dataset", "defrec", empty.path().string(), "--out", out}) == 3);
    CHECK(run({"--dataset", "defrec", empty / "absent", "--out", out}) == 3);
    CHECK(run({"--dataset", "defrec", "--out", out}) == 2);
    CHECK(run({"--dataset", "defrec", empty.path().string()}) == 2);
    CHECK(run({empty.path().string(), "--out", out}) == 2);
    CHECK_FALSE(fs::exists(out));
    for (const char* shard : {"0/3", "4/3", "1", "1/x", "1/2/3", "-1/3"})
        CHECK_THROWS_AS(parse_shard(shard), CliError);
    CHECK(parse_shard("2/3").number == 2);
    CHECK(run({"--list"}) == 0);
    CHECK(run({"--dataset", "defrec", data_set().path().string(), "--list"}) == 0);
}
