// The page that ReportWriter writes: whole, self-contained, bounded, and safe against what is in
// names.
#include "sdk/report/report.hpp"

#include <doctest/doctest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "sdk/report/synthetic_sequence.hpp"
#include "sdk/report/test_page.hpp"

namespace fs = std::filesystem;
using defrec::cli::FrameRecord;
using defrec::cli::ReportMeta;
using defrec::cli::ReportWriter;
using defrec::cli::test::is_plain;
using defrec::cli::test::read_page;
using defrec::cli::test::SyntheticSequence;
using nlohmann::json;

namespace {

struct Folder {
    fs::path path =
        fs::temp_directory_path() / fs::path("defrec-report-" + std::to_string(::getpid()));
    Folder() { fs::create_directories(path); }
    ~Folder() { fs::remove_all(path); }
};

json data_of(const std::string& page) {
    const std::string open = "<script type=\"application/json\" id=\"data\">";
    const std::size_t start = page.find(open) + open.size();
    return json::parse(page.substr(start, page.find("</script>", start) - start));
}

std::map<std::string, int> state_counts(const json& summary) {
    std::map<std::string, int> counts;
    for (const json& state : summary["states"]) counts[state["name"]] = state["frames"];
    return counts;
}

// The numbers in base64 without line breaks.
template <class Value>
std::vector<Value> values_of(const std::string& text) {
    const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string bytes;
    std::uint32_t bits = 0;
    for (std::size_t i = 0; i < text.size() && text[i] != '='; ++i) {
        bits = bits << 6 | static_cast<std::uint32_t>(letters.find(text[i]));
        if (i % 4 != 0) bytes += static_cast<char>(bits >> (6 - 2 * (i % 4)) & 0xff);
    }
    std::vector<Value> values(bytes.size() / sizeof(Value));
    std::memcpy(values.data(), bytes.data(), values.size() * sizeof(Value));
    return values;
}

}  // namespace

TEST_CASE("a 60 frame report is one file below 4 MB that loads nothing from elsewhere") {
    const Folder folder;
    const fs::path path = folder.path / "report.html";
    const SyntheticSequence sequence(960, 540, 60);
    ReportMeta meta;
    meta.sequence = "synthetic";
    meta.overlay_file = "overlay.mp4";
    sequence.write_report(path, meta);
    const std::string page = read_page(path);
    CHECK(page.size() < 4'000'000);
    CHECK(std::distance(fs::directory_iterator(folder.path), {}) == 1);

    // The markup and style, which stand before the data, name no address; and the page forbids
    // loading to itself.
    CHECK(page.substr(0, page.find("id=\"data\"")).find("//") == std::string::npos);
    CHECK(page.find("Content-Security-Policy\" content=\"default-src 'none'") != std::string::npos);
    CHECK(page.find("<link") == std::string::npos);
    CHECK(page.find("<script src") == std::string::npos);
    if (!is_plain(page)) {
        CHECK(page.find("Leon Sorokin") != std::string::npos);
        CHECK(page.find("three.js authors") != std::string::npos);
    }

    const json data = data_of(page);
    CHECK(data["summary"]["frames"] == 60);
    CHECK(data["summary"]["stages"].size() == 5);
    CHECK(data["summary"]["frame_ms"]["median"].get<double>() == doctest::Approx(12).epsilon(0.1));
    CHECK(data["summary"]["stages"][4]["name"] == "lm");
    CHECK(data["summary"]["stages"][4]["ms"]["median"].get<double>() ==
          doctest::Approx(3.2).epsilon(0.01));
    CHECK(data["surface"]["moments"].size() == 60);
    CHECK(data["key_frames"].size() <= 14);
    // initialising, tracking, degraded, tracking, lost, relocalised to the end
    CHECK(data["summary"]["changes"].size() == 6);
    CHECK_FALSE(data["surface"]["moments"][38].contains("points"));
    CHECK(data["surface"]["moments"][38]["state"] == "lost");
    const std::size_t targets = sequence.record(1).targets.size();
    CHECK(data["surface"]["targets"]["count"] == targets);
    CHECK(data["surface"]["targets"]["labels"].size() == targets);
    CHECK(data["surface"]["targets"]["labels"][0]["depth"] == 5);
    CHECK(data["surface"]["moments"][1]["targets"].contains("shapes"));
    CHECK_FALSE(data["surface"]["moments"][38].contains("targets"));
    const std::size_t points = sequence.record(1).points.size();
    CHECK(data["points"]["count"] == points);
    CHECK(data["points"]["listed"].size() == points);
    CHECK(data["points"]["listed"][0]["name"] == "first");
    CHECK(data["points"]["listed"][0]["frames"] == json({54, 0, 6}));
    CHECK(data["points"]["listed"][0]["median_mm"].get<double>() ==
          doctest::Approx(std::sqrt(0.1)).epsilon(0.01));
    CHECK(data["points"]["moments"].size() == 60);
    CHECK(data["image"] == json({960, 540}));
}

TEST_CASE("frames in which the picture stands still are told as the live view tells them") {
    const Folder folder;
    const SyntheticSequence sequence(160, 120, 2);
    ReportWriter report(folder.path / "report.html", {}, sequence.projector());
    FrameRecord record = sequence.record(1);
    for (int i = 0; i < 9; ++i) {
        record.index = i;
        record.timestamp_ms = 300 * i;
        record.state = i < 2 ? "tracking" : i < 5 ? "degraded" : i < 7 ? "lost" : "degraded";
        record.reasons = i < 2 ? "" : i < 5 ? "frozen" : "few-matches, low-contrast";
        report.add(cv::Mat(120, 160, CV_8UC3, cv::Scalar::all(90)), record);
    }
    report.finish();
    const json data = data_of(read_page(folder.path / "report.html"));
    const json& summary = data["summary"];
    REQUIRE(summary["frozen"].size() == 1);
    CHECK(summary["frozen"][0]["where"] == "frame 4");
    CHECK(summary["frozen"][0]["why"] == "the picture stands still; check the video source");
    REQUIRE(summary["losses"].size() == 1);
    CHECK(summary["losses"][0]["where"] == "frames 5 to 6");
    CHECK(
        state_counts(summary) ==
        std::map<std::string, int>{{"tracking", 2}, {"degraded", 4}, {"stalled", 1}, {"lost", 2}});
    CHECK(summary["changes"][2]["frame"] == 4);
    CHECK(summary["changes"][2]["state"] == "stalled");
    const json& pictures = data["key_frames"];
    CHECK(std::any_of(pictures.begin(), pictures.end(),
                      [](const json& each) { return each["state"] == "stalled"; }));
}

TEST_CASE("tissue that is found at the start is not found again, and both are said for a while") {
    const Folder folder;
    const SyntheticSequence sequence(160, 120, 2);
    ReportWriter report(folder.path / "report.html", {}, sequence.projector());
    FrameRecord record = sequence.record(1);
    for (int i = 0; i < 20; ++i) {
        record.index = i;
        record.timestamp_ms = 1000 * i;
        record.state = i == 0 || i == 10 ? "relocalised" : i == 9 ? "lost" : "tracking";
        report.add({}, record);
    }
    report.finish();
    const json summary = data_of(read_page(folder.path / "report.html"))["summary"];
    CHECK(summary["changes"][0]["state"] == "found");
    CHECK(
        state_counts(summary) ==
        std::map<std::string, int>{{"found", 5}, {"relocalised", 5}, {"lost", 1}, {"tracking", 9}});
}

TEST_CASE("a time without pictures is told, and is no video") {
    const Folder folder;
    const SyntheticSequence sequence(160, 120, 2);
    ReportWriter report(folder.path / "report.html", {}, sequence.projector());
    FrameRecord record = sequence.record(1);
    for (int i = 0; i < 100; ++i) {
        record.index = i;
        record.timestamp_ms = 40 * i + (i < 50 ? 0 : 20000);
        record.reasons = i == 50 ? "gap" : "";
        report.add({}, record);
    }
    report.finish();
    const json summary = data_of(read_page(folder.path / "report.html"))["summary"];
    CHECK(summary["gaps"] == json({{"count", 1},
                                   {"total_ms", 20040.0},
                                   {"listed", {{{"from_ms", 1960.0}, {"to_ms", 22000.0}}}}}));
    CHECK(summary["duration_ms"] == 99 * 40 - 40);
}

TEST_CASE("frames whose positions are not measured are told apart from those that are less sure") {
    const Folder folder;
    const SyntheticSequence sequence(160, 120, 2);
    ReportWriter report(folder.path / "report.html", {}, sequence.projector());
    FrameRecord record = sequence.record(1);
    record.state = "degraded";
    record.reasons = "dark, one-view";
    record.faulty_views = "right";
    record.observed_share = 0;
    for (int i = 0; i < 4; ++i) {
        record.index = i;
        record.timestamp_ms = 300 * i;
        report.add({}, record);
    }
    report.finish();
    const json summary = data_of(read_page(folder.path / "report.html"))["summary"];
    const char* why = "the right picture is black; check lens, cable and input of that view";
    CHECK(summary["unusable"] == json({{{"where", "frames 2 to 3"}, {"why", why}}}));
    CHECK(summary["degraded"] == json({{{"where", "frames 0 to 1"}, {"why", why}}}));
}

TEST_CASE("frames are less sure by errors of points, and say so, whatever else is noticed") {
    const Folder folder;
    const SyntheticSequence sequence(160, 120, 2);
    ReportWriter report(folder.path / "report.html", {}, sequence.projector());
    FrameRecord record = sequence.record(1);
    REQUIRE(record.points.size() > 1);
    for (auto& point : record.points) {
        point.status = defrec::cli::VertexStatus::observed;
        point.is_chosen = true;
        point.covariance = {0.1f, 0, 0, 0.1f, 0, 0.1f};
    }
    record.state = "tracking";
    record.reasons = "fast-motion, contradicted";
    for (int i = 0; i < 3; ++i) {
        record.index = i;
        record.points[1].covariance[0] = i > 0 ? 16.0f : 0.1f;
        report.add(sequence.image(1), record);
    }
    report.finish();
    const json data = data_of(read_page(folder.path / "report.html"));
    CHECK(state_counts(data["summary"]) ==
          std::map<std::string, int>{{"tracking", 1}, {"degraded", 2}});
    CHECK(data["summary"]["degraded"] ==
          json({{{"where", "frames 1 to 2"},
                 {"why", "a chosen point has an expected error above 3 mm"}}}));
    CHECK(data["summary"]["changes"].back()["reasons"] == "fast-motion, contradicted, point-error");
}

TEST_CASE("degraded frames are told with their causes, the picture that fails among them") {
    const Folder folder;
    const SyntheticSequence sequence(160, 120, 2);
    ReportWriter report(folder.path / "report.html", {}, sequence.projector());
    FrameRecord record = sequence.record(1);
    for (int i = 0; i < 9; ++i) {
        record.index = i;
        record.state = i < 2 ? "tracking" : "degraded";
        record.reasons = i < 2 ? "occluded" : i < 6 ? "dark, one-view" : "view-late";
        record.faulty_views = i < 2 ? "" : "right";
        report.add({}, record);
    }
    report.finish();
    const json data = data_of(read_page(folder.path / "report.html"));
    CHECK(data["summary"]["losses"].empty());
    CHECK(data["summary"]["degraded"] ==
          json({{{"where", "frames 2 to 5"},
                 {"why", "the right picture is black; check lens, cable and input of that view"}},
                {{"where", "frames 6 to 8"},
                 {"why", "the right picture stands still; check that video input"}}}));
    CHECK(data["summary"]["changes"].back()["faulty_views"] == "right");
}

TEST_CASE("a plan's parts and targets are listed with their errors, beside the points") {
    const Folder folder;
    const SyntheticSequence sequence(160, 120, 2);
    ReportWriter report(folder.path / "report.html", {}, sequence.projector());
    FrameRecord record = sequence.record(1);
    record.plan.model = std::make_shared<const defrec::cli::PlanModel>();
    record.plan.targets.assign(2, record.points.at(0));
    for (auto& target : record.plan.targets) target.name.clear();
    record.plan.targets[0].id = 0;
    record.plan.targets[1].id = 1;
    record.plan.parts.assign(1, record.points.at(0));
    record.plan.parts[0].id = 0;
    record.plan.parts[0].name = "tumour";
    report.add({}, record);
    report.finish();
    const json data = data_of(read_page(folder.path / "report.html"));
    REQUIRE(data["plan"]["listed"].size() == 3);
    CHECK(data["plan"]["listed"][0]["name"] == "tumour");
    CHECK(data["plan"]["listed"][2]["id"] == 1);
    CHECK(data["plan"]["listed"][1]["median_mm"].get<double>() ==
          doctest::Approx(std::sqrt(0.1)).epsilon(0.01));
    CHECK(data["points"]["listed"].size() == record.points.size());
}

TEST_CASE("the plots show each largest error, and no residual where nothing was measured") {
    const Folder folder;
    const SyntheticSequence sequence(160, 120, 2);
    ReportWriter report(folder.path / "report.html", {}, sequence.projector());
    FrameRecord record = sequence.record(1);
    const float variance = record.points.at(0).covariance[0];
    for (int i = 0; i < 500; ++i) {
        record.index = i;
        record.timestamp_ms = i * 40.0;
        record.points[0].covariance[0] = i == 301 ? 64.0f : variance;
        record.observed_share = i == 100 ? 0 : 0.8;
        record.mean_residual_mm = i == 100 ? std::nan("") : 0.2;
        report.add({}, record);
    }
    report.finish();
    const json data = data_of(read_page(folder.path / "report.html"));
    const json& points = data["points"];
    double shown = 0;
    for (const json& moment : points["moments"])
        shown = std::max(shown, values_of<std::uint16_t>(moment["largest"])[0] *
                                    points["error_step_mm"].get<double>());
    CHECK(points["moments"].size() <= 240);
    CHECK(shown == doctest::Approx(points["listed"][0]["largest_mm"].get<double>()).epsilon(0.01));
    CHECK(shown > 8);
    for (const json& line : data["series"]["lines"]) {
        if (line["name"] != "residual_mm") continue;
        const std::vector<float> residuals = values_of<float>(line["values"]);
        CHECK(std::isnan(residuals.at(100)));
        CHECK(residuals.at(101) == doctest::Approx(0.2));
    }
}

TEST_CASE("points of a grid are not listed, and of many chosen ones some are, evenly") {
    const Folder folder;
    const SyntheticSequence sequence(160, 120, 2);
    ReportWriter report(folder.path / "report.html", {}, sequence.projector());
    FrameRecord record = sequence.record(1);
    for (auto& point : record.points) point.is_chosen = false;
    SUBCASE("a grid") {
        report.add({}, record);
        report.finish();
        CHECK(data_of(read_page(folder.path / "report.html"))["points"].is_null());
    }
    SUBCASE("500 points, of which one begins later") {
        record.points.assign(500, record.points.at(0));
        for (std::int64_t i = 0; i < 500; ++i) {
            record.points[static_cast<std::size_t>(i)].id = 1000 - i;
            record.points[static_cast<std::size_t>(i)].is_chosen = i > 0;
        }
        report.add({}, record);
        record.points[0].is_chosen = true;
        report.add({}, record);
        report.finish();
        const json points = data_of(read_page(folder.path / "report.html"))["points"];
        CHECK(points["count"] == 500);
        CHECK(points["listed"].size() == 100);
        CHECK(points["listed"][0]["id"] == 999);
        CHECK(points["listed"][1]["id"] == 994);
        CHECK(points["moments"].size() == 2);
    }
}

TEST_CASE(
    "row 75: names that are markup, script or not UTF-8 do no harm; no residual without a "
    "surface") {
    const Folder folder;
    const fs::path path = folder.path / fs::path(u8"Bericht ä 膜.html");
    ReportMeta meta;
    meta.sequence = "</script><script>document.title='broken'</script><!--\xff\xe2\x80\xa8";
    meta.facts = {{"Left", "a&b\"<img src=x onerror=alert(1)>.mp4"}};
    const SyntheticSequence sequence(160, 120, 2);
    ReportWriter report(path, meta, sequence.projector());
    FrameRecord record = sequence.record(0);
    record.vertices.clear();
    report.add({}, record);
    report.finish();
    const std::string page = read_page(path);
    CHECK(page.find("document.title='broken'</script>") == std::string::npos);
    CHECK(page.find("<img src=x") == std::string::npos);
    const json data = data_of(page);
    CHECK(data["meta"]["facts"][0][1] == "a&b\"<img src=x onerror=alert(1)>.mp4");
    CHECK(data["summary"]["residual_mm"].is_null());
    CHECK(data["meta"]["sequence"].get<std::string>().starts_with("</script><script>"));
}

TEST_CASE("a long sequence stays within its bounds") {
    const Folder folder;
    const fs::path path = folder.path / "report.html";
    const SyntheticSequence sequence(320, 240, 2);
    ReportWriter report(path, {}, sequence.projector());
    report.set_template(sequence.reference(), {});
    FrameRecord record = sequence.record(1);
    record.targets.resize(20'000);
    record.targets[0].depth = std::nanf("");
    for (int i = 0; i < 9'000; ++i) {
        record.index = i;
        record.timestamp_ms = i * 40.0;
        record.state = i / 10 % 2 ? "tracking" : "degraded";
        record.mean_residual_mm = i == 5'345 ? 9 : 0.2;
        report.add({}, record);
    }
    report.finish();
    CHECK(fs::file_size(path) < 5'000'000);
    const json data = data_of(read_page(path));
    CHECK(data["summary"]["frames"] == 9'000);
    CHECK(data["surface"]["moments"].size() <= 120);
    CHECK(data["surface"]["moments"].size() >= 60);
    CHECK(data["series"]["frames"].size() <= 4096);
    CHECK(data["series"]["stride"] == 4);
    CHECK(data["summary"]["changes"].size() == 100);
    CHECK(data["summary"]["unlisted_changes"] == 800);
    CHECK(data["surface"]["targets"]["count"] == 20'000);
    CHECK(data["surface"]["targets"]["labels"].size() <= 500);
    CHECK(data["surface"]["targets"]["labels"].size() >= 250);
    CHECK(data["surface"]["targets"]["labels"][0]["depth"].is_null());
}

TEST_CASE("a report without any frame is written") {
    const Folder folder;
    ReportWriter report(folder.path / "report.html", {},
                        SyntheticSequence(160, 120, 2).projector());
    report.finish();
    CHECK(data_of(read_page(folder.path / "report.html"))["summary"]["frames"] == 0);
}

TEST_CASE(
    "a folder that is not there is refused at once, and an unfinished report leaves nothing") {
    const Folder folder;
    const SyntheticSequence sequence(160, 120, 2);
    CHECK_THROWS_WITH_AS(
        ReportWriter(folder.path / "none" / "report.html", {}, sequence.projector()),
        doctest::Contains("report.html: the file cannot be created"), std::runtime_error);
    { ReportWriter abandoned(folder.path / "report.html", {}, sequence.projector()); }
    CHECK(fs::is_empty(folder.path));
}

TEST_CASE("a template whose sizes disagree is refused with what was given") {
    const Folder folder;
    const SyntheticSequence sequence(160, 120, 2);
    ReportWriter report(folder.path / "report.html", {}, sequence.projector());
    auto reference = sequence.reference();
    reference.triangles.push_back(9999);
    CHECK_THROWS_AS(report.set_template(reference, {}), std::invalid_argument);
    reference.triangles.push_back(0);
    reference.triangles.push_back(1);
    CHECK_THROWS_WITH_AS(report.set_template(reference, {}), doctest::Contains("names vertex 9999"),
                         std::invalid_argument);
}
