// What is written, read back. check_report_files.py looks at the same files from outside.
#include "conformance/report/report.hpp"

#include <doctest/doctest.h>
#include <png.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "conformance/report/json_report.hpp"
#include "conformance/report/junit.hpp"
#include "conformance/report/page.hpp"
#include "conformance/report/png.hpp"
#include "conformance/report/sample_report.hpp"
#include "conformance/report/text.hpp"

using namespace defrec::conformance;

namespace {

std::string file_text(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("three files, for a run that passed and one that failed") {
    const std::filesystem::path root = DEFREC_SAMPLE_REPORT;
    std::filesystem::remove_all(root);
    for (const auto& [name, run] :
         {std::pair("passed", sample_run()), std::pair("failed", sample_failed_run())}) {
        write_report(run, root / name);
        for (const char* file : {kReportFile, kJunitFile, kPageFile})
            CHECK(file_text(root / name / file).size() > 500);
        CHECK(std::distance(std::filesystem::directory_iterator(root / name), {}) == 3);
    }
    CHECK_THROWS_AS(write_report(sample_run(), root / "passed" / kReportFile), ReportError);
}

TEST_CASE("every figure survives") {
    const RunRecord run = with_valid_text(sample_failed_run());
    const auto report = nlohmann::json::parse(report_text(run, "", ""));
    const RunRecord read = record_of(report);
    CHECK(read.seed == run.seed);
    CHECK(read.device_name == run.device_name);
    REQUIRE(read.cases.size() == run.cases.size());
    CHECK(read.cases[1].metrics[0].maximum == 1.4375);
    CHECK(std::isnan(read.cases[1].metrics[1].maximum));
    CHECK(read.cases[1].metrics[1].p99 == std::numeric_limits<double>::infinity());
    CHECK(read.cases[2].pictures.size() == 3);
    CHECK(read.cases[2].reason ==
          "3 of 64897 disparities differ by up to 16/16 px; \xEF\xBF\xBD the first at <211, 17>.");
    CHECK(report["counts"]["all"] == nlohmann::json{{"passed", 1}, {"failed", 2}, {"skipped", 1}});
    CHECK(report["counts"]["tiers"]["abi"]["passed"] == 1);
}

TEST_CASE("each case stands in one line of the file, and each other member too") {
    const RunRecord run = with_valid_text(sample_failed_run());
    const std::string text = report_text(run, "", "");
    const auto report = nlohmann::json::parse(text);
    CHECK(std::count(text.begin(), text.end(), '\n') ==
          static_cast<std::ptrdiff_t>(run.cases.size() + report.size() + 3));
    for (const auto& one : report["cases"]) CHECK(contains(text, "\n  " + one.dump()));
    CHECK(contains(text, "\n \"counts\": " + report["counts"].dump() + ",\n"));
    CHECK(nlohmann::json::parse(file_text(report)) == report);
}

TEST_CASE("a report with a member too many, too few or of another type is none") {
    const auto good = nlohmann::json::parse(report_text(sample_run(), "", ""));
    CHECK_NOTHROW(record_of(good));
    const auto refused = [&](const char* pointer, const nlohmann::json& value) {
        auto report = good;
        report[nlohmann::json::json_pointer(pointer)] = value;
        CHECK_THROWS_AS(record_of(report), ReportError);
    };
    refused("/more", 1);
    refused("/format", 2);
    refused("/device/more", 1);
    refused("/device/kind", -1);
    refused("/device/kind", uint64_t{1} << 32);
    refused("/cases/0/verdict", "fine");
    refused("/cases/1/metrics/0/maximum", "1");
    refused("/counts/all/passed", 4);
    auto report = good;
    report["cases"][0].erase("reason");
    CHECK_THROWS_AS(record_of(report), ReportError);
}

TEST_CASE("text: what is no UTF-8, and what XML forbids, is replaced") {
    CHECK(valid_text("plain \xC3\xA9\xE2\x82\xAC\xF0\x9F\x98\x80\n") ==
          "plain \xC3\xA9\xE2\x82\xAC\xF0\x9F\x98\x80\n");
    const std::string mark = "\xEF\xBF\xBD";
    CHECK(valid_text(std::string_view("\0", 1)) == mark);
    CHECK(valid_text("\x1B") == mark);
    CHECK(valid_text("\xC3") == mark);                        // cut short
    CHECK(valid_text("\xC0\x80") == mark + mark);             // overlong
    CHECK(valid_text("\xED\xA0\x80") == mark + mark + mark);  // a surrogate
    CHECK(valid_text("\xEF\xBF\xBF") == mark);                // U+FFFF
}

TEST_CASE("the page carries everything inside, and marks nothing up that came from outside") {
    const std::string page = page_html(with_valid_text(sample_failed_run()));
    CHECK(contains(page, "A device &lt;with&gt; &quot;signs&quot; &amp; accents"));
    CHECK_FALSE(contains(page, "<with>"));
    CHECK_FALSE(contains(page, "http://"));
    CHECK_FALSE(contains(page, "https://"));
    CHECK(contains(page, "data:image/png;base64,iVBOR"));
    CHECK(contains(page, "What failed"));
    CHECK_FALSE(contains(page_html(sample_run()), "What failed"));
    RunRecord part = sample_run();
    part.complete = false;
    CHECK(contains(page_html(part), "no certificate"));
    CHECK_FALSE(contains(page_html(sample_run()), "no certificate"));
}

TEST_CASE("pictures decode to their pixels") {
    const Picture picture = sample_picture("waves", 3);
    const std::vector<uint8_t> bytes = png_of(picture);
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    REQUIRE(png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()));
    image.format = PNG_FORMAT_RGB;
    REQUIRE(image.width == picture.width);
    REQUIRE(image.height == picture.height);
    std::vector<uint8_t> pixels(PNG_IMAGE_SIZE(image));
    REQUIRE(png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr));
    CHECK(pixels == picture.pixels);
    Picture torn = picture;
    torn.pixels.pop_back();
    CHECK_THROWS_AS(png_of(torn), ReportError);
}

TEST_CASE("the share of a limit") {
    CHECK(share_of_limit({"m", "", 1, 0.5, 2, 2, 1}) == 0.5);
    CHECK(share_of_limit({"m", "", 1, 3, 2, 2, 1}) == 1.5);
    CHECK(share_of_limit({"m", "", 0, 0, 0, 0, 1}) == 0);
    CHECK(std::isinf(share_of_limit({"m", "", 1, 0, 0, 0, 1})));
    CHECK(std::isinf(share_of_limit({"m", "", std::nan(""), 0, 1, 1, 1})));
}
