// Tables and page of an evaluation, from numbers worked out by hand.
#include "sdk/evaluation/results.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "sdk/io/exit_code.hpp"
#include "sdk/io/test_folder.hpp"

using namespace defrec::cli;

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

ClipResult clip_of(const std::string& name, double error, double share) {
    ClipResult clip;
    clip.clip = name;
    clip.outcome.frames = 2;
    clip.outcome.frame_ms = {10 * error, 20 * error};
    clip.outcome.seconds = 1;
    clip.outcome.remark = "frame 1 of " + name;
    clip.values = {error, share};
    return clip;
}

Results two_variants() {
    Results results{"a set", "the <root>", {{"error_mm"}, {"share", true}}, {}};
    ClipResult bad = clip_of("c", 0, 0);
    bad.values.clear();
    bad.outcome.frames = 0;
    bad.outcome.failure = "no file, none\nat all";
    results.variants.push_back(
        {"one", {clip_of("a", 0.5, 1), clip_of("b", 2, 0.25), bad}, {1, 0.5}});
    results.variants.push_back({"two", {clip_of("a", 1, kNone)}, {1.5, kNone}});
    return results;
}

}  // namespace

TEST_CASE("tables have a row for each clip and for each variant") {
    const Results results = two_variants();
    CHECK(results_csv(results) ==
          "variant,clip,status,frames,error_mm,share,reason,notes\n"
          "one,a,done,2,0.5,1,,\n"
          "one,b,done,2,2,0.25,,\n"
          "one,c,quarantined,0,,,no file; none at all,\n"
          "two,a,done,2,1,,,\n");
    CHECK(summary_csv(results) ==
          "variant,clips,quarantined,doubtful,error_mm,share\none,3,1,0,1,0.5\ntwo,1,0,0,1.5,\n");
    CHECK(times_csv(results).find("one,b,2,20,40,1.000\n") != std::string::npos);
    CHECK(effects_csv(results) ==
          "variant,metric,value,first,change,clips,clip_change,low,high\n"
          "one,error_mm,1,1,0,2,0,0,0\none,share,0.5,0.5,0,2,0,0,0\n"
          "one,frame_ms,12.5,12.5,0,2,0,0,0\n"
          "two,error_mm,1.5,1,0.5,1,0.5,,\ntwo,share,,0.5,,0,,,\n"
          "two,frame_ms,10,12.5,-2.5,1,5,,\n");
    const std::string text = results_text(results);
    CHECK(text.find("clips_per_hour                 3600           3600\n") != std::string::npos);
}

TEST_CASE(
    "row 127: a name that a spreadsheet would take for a formula has an apostrophe before it") {
    Results results{"a set", "the root", {{"error_mm"}}, {}};
    results.variants.push_back({"+one", {}, {kNone}});
    for (const char* name : {"=1+1", "-2", "@SUM(A1)", "a=b"}) {
        ClipResult clip = clip_of(name, 1, 1);
        clip.values = {1};
        results.variants[0].clips.push_back(clip);
    }
    const std::string text = results_csv(results) + summary_csv(results) + times_csv(results);
    CHECK(text.find("'+one,'=1+1,done") != std::string::npos);
    CHECK(text.find("'+one,a=b,done") != std::string::npos);
    for (const char* raw : {",=", "\n=", ",-2", ",@", "\n+"}) {
        CAPTURE(raw);
        CHECK(text.find(raw) == std::string::npos);
    }
}

TEST_CASE("a doubtful clip has its numbers and its reason, and is in nothing of all clips") {
    Results results = two_variants();
    results.variants[0].clips[0].outcome.notes = "a frame is missing, the last";
    Outcome& worst = results.variants[0].clips[1].outcome;
    worst.doubt = "it is in <metres>, not mm";
    CHECK(results.variants[0].doubtful() == 1);
    CHECK(results.variants[0].quarantined() == 1);
    const std::string table = results_csv(results);
    CHECK(table.find("one,a,done,2,0.5,1,,a frame is missing; the last\n") != std::string::npos);
    CHECK(table.find("one,b,doubtful,2,2,0.25,it is in <metres>; not mm,\n") != std::string::npos);
    CHECK(summary_csv(results).find("one,3,1,1,1,0.5\n") != std::string::npos);
    CHECK(effects_csv(results).find("one,error_mm,1,1,0,1,0,,\n") != std::string::npos);
    const std::string page = results_page(results);
    CHECK(page.find("<p class=\"doubt\"><strong>1 clip is doubtful:</strong>") !=
          std::string::npos);
    CHECK(page.find("<h2>Doubtful</h2>") != std::string::npos);
    CHECK(page.find("<td class=\"text\">it is in &lt;metres&gt;, not mm</td>") !=
          std::string::npos);
    CHECK(page.find("<td class=\"text\">a frame is missing, the last</td>") != std::string::npos);
    CHECK(page.find("<b>b</b>") == std::string::npos);  // it is none of the worst clips
    CHECK(results_page(two_variants()).find("doubtful:") == std::string::npos);
}

TEST_CASE("targets have a row for each depth, and a table only where there are any") {
    Results results = two_variants();
    CHECK_FALSE(results.has_depths());
    CHECK(results_page(results).find("Targets by depth") == std::string::npos);
    results.depth_metrics = {{"median_mm"}, {"lost_share"}};
    results.variants[0].clips[0].depths = {{"5 mm", {0.5, 0}}, {"20 mm", {kNone, 1}}};
    results.variants[0].depths = {{"5 mm", {0.5, 0}}};
    CHECK(results.has_depths());
    CHECK(results_by_depth_csv(results) ==
          "variant,clip,depth,median_mm,lost_share\none,a,5 mm,0.5,0\none,a,20 mm,,1\n");
    CHECK(summary_by_depth_csv(results) == "variant,depth,median_mm,lost_share\none,5 mm,0.5,0\n");
    CHECK(results_page(results).find("<td>5 mm</td><td>one</td><td>0.500</td><td>0.000</td>") !=
          std::string::npos);
}

TEST_CASE("clips are ranked by what is good, and no number is worst") {
    const Metric error{"error"}, share{"share", true};
    CHECK(is_worse(error, 2, 1));
    CHECK_FALSE(is_worse(error, 1, 1));
    CHECK(is_worse(share, 1, 2));
    CHECK(is_worse(error, kNone, 1e9));
    CHECK_FALSE(is_worse(share, 1, kNone));
    CHECK_FALSE(is_worse(share, kNone, kNone));
}

TEST_CASE("the page has the table, a distribution, the worst clip first, and stands alone") {
    const TestFolder folder;
    folder.write("picture.jpg", "abc");
    Results results = two_variants();
    for (ClipResult& clip : results.variants.front().clips) clip.folder = folder.path();
    const std::string page = results_page(results);
    CHECK(page.find("the &lt;root&gt;") != std::string::npos);
    CHECK(page.find("<td>error_mm</td><td>1.000</td><td>1.500</td>") != std::string::npos);
    CHECK(page.find("no file, none\nat all") != std::string::npos);
    CHECK(page.find("share of clips with at most this error_mm") != std::string::npos);
    CHECK(page.find("<td>two</td><td>+0.500</td><td>&ndash;</td><td>-2.500</td>") !=
          std::string::npos);
    const std::size_t b = page.find("<b>b</b>, error_mm 2.000<br>frame 1 of b");
    CHECK(b != std::string::npos);
    CHECK(b < page.find("<b>a</b>, error_mm 0.500"));
    CHECK(page.find("src=\"data:image/jpeg;base64,YWJj\"") != std::string::npos);
    for (const char* absent : {"nan", "http:", "https:", "<script"})
        CHECK_MESSAGE(page.find(absent) == std::string::npos, absent);
}

TEST_CASE("samples come back as they were") {
    const TestFolder folder;
    Samples samples({"a", "b"});
    samples.add({0.1, kNone});
    samples.add({-1e-300, std::numeric_limits<double>::infinity()});
    samples.write(folder.path() / "samples.csv");
    CHECK(TestFolder::read(folder / "samples.csv") == "a,b\n0.1,\n-1e-300,inf\n");
    Samples back({"a", "b"});
    back.read(folder.path() / "samples.csv");
    back.append(samples);
    REQUIRE(back.size() == 4);
    CHECK(back.at(0, 0) == 0.1);
    CHECK(std::isnan(back.at(2, 1)));
    CHECK(back.at(1, 0) == -1e-300);
    CHECK(std::isinf(back.at(3, 1)));
    folder.write("samples.csv", "a,b\n1,x\n");
    CHECK_THROWS_AS(back.read(folder.path() / "samples.csv"), CliError);
}

TEST_CASE("a clip's folder is one component, appears whole, and replaces an earlier one") {
    const TestFolder folder;
    const ClipStore store(folder.path());
    const ClipName name{"default", "a/b c"};
    CHECK(store.folder(name) == folder.path() / "clips/default/a%2Fb%20c");
    CHECK(store.folder({"default", "."}).filename() == "%2E");
    CHECK_FALSE(store.outcome(name));
    const std::filesystem::path partial = store.begin(name);
    CHECK(partial != store.folder(name));
    ClipScore score{Samples({"x"}), 7, {2.5, 3.5}, "jpeg", "a remark", "a doubt", "notes"};
    score.samples.add({1});
    write_score(partial, score);
    CHECK_FALSE(store.outcome(name));
    Outcome outcome;
    outcome.settings = "{}";
    outcome.seconds = 1.5;
    store.commit(name, outcome);
    const auto read = store.outcome(name);
    REQUIRE(read);
    CHECK(read->frames == 7);
    CHECK(read->frame_ms.median == 2.5);
    CHECK(read->frame_ms.p95 == 3.5);
    CHECK(read->remark == "a remark");
    CHECK(read->doubt == "a doubt");
    CHECK(read->notes == "notes");
    CHECK_FALSE(read->counts());
    CHECK(read->seconds == 1.5);
    CHECK(std::filesystem::exists(store.folder(name) / kPictureFile));

    store.begin(name);
    outcome.failure = "it crashed \xff";
    store.commit(name, outcome);
    CHECK(store.outcome(name)->failure == "it crashed \xef\xbf\xbd");
    CHECK_FALSE(std::filesystem::exists(store.folder(name) / kPictureFile));
    CHECK_FALSE(std::filesystem::exists(partial));
    folder.write("clips/default/a%2Fb%20c/clip.json", "{}");
    CHECK_THROWS_AS(store.outcome(name), CliError);
}
