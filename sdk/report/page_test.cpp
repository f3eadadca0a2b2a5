// The page in a browser: its script runs to the end and meets no error.
#include <doctest/doctest.h>
#include <unistd.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>

#include "sdk/report/report.hpp"
#include "sdk/report/synthetic_sequence.hpp"
#include "sdk/report/test_page.hpp"

namespace fs = std::filesystem;
using namespace defrec::cli;
using namespace defrec::cli::test;

TEST_CASE("the page shows itself without an error") {
    if (!have_chromium()) {
        MESSAGE("skipped: chromium is not installed");
        return;
    }
    const fs::path folder =
        fs::temp_directory_path() / ("defrec-page-" + std::to_string(::getpid()));
    fs::create_directories(folder);
    const fs::path page = folder / "report.html";
    SUBCASE("a tracked sequence") {
        const SyntheticSequence sequence(480, 270, 20);
        ReportMeta meta;
        meta.sequence = "<b>synthetic</b>";
        meta.overlay_file = "overlay.mp4";
        sequence.write_report(page, meta);
        const std::string dom = browse(page, folder);
        CHECK(dom.find("&lt;b&gt;synthetic&lt;/b&gt;</h1>") != std::string::npos);
        CHECK(dom.find("<section id=\"targets\" aria-labelledby=\"targets-title\">") !=
              std::string::npos);
        CHECK(dom.find("5 mm deep: median 0.59 mm") != std::string::npos);
        CHECK(dom.find("<section id=\"points\" aria-labelledby=\"points-title\">") !=
              std::string::npos);
        CHECK(dom.find("<h3>Point first</h3>") != std::string::npos);
        CHECK(dom.find("aria-label=\"Expected error, mm\"") != std::string::npos);
        CHECK(dom.find("<polyline") != std::string::npos);
        if (!is_plain(read_page(page))) {
            CHECK(dom.find("data-targets=\"0\"") == std::string::npos);
            CHECK(dom.find("data-targets=") != std::string::npos);
            CHECK(dom.find("class=\"uplot") != std::string::npos);
            CHECK(dom.find("expected error</option>") != std::string::npos);
            CHECK(dom.find("data-ellipsoids=\"0\"") == std::string::npos);
            CHECK(dom.find("data-ellipsoids=") != std::string::npos);
            CHECK(dom.find("<p id=\"no-surface\" class=\"banner\" hidden=\"\">") !=
                  std::string::npos);
        }
    }
    SUBCASE("no frame at all") {
        ReportWriter report(page, {}, SyntheticSequence(64, 48, 2).projector());
        report.finish();
        const std::string dom = browse(page, folder);
        CHECK(dom.find("aria-labelledby=\"targets-title\" hidden=\"\"") != std::string::npos);
    }
    fs::remove_all(folder);
}
