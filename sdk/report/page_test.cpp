// The page in a browser: its script runs to the end and meets no error.
#include <doctest/doctest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
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
        meta.notes = {{ReportSeverity::remark, "a remark"}, {ReportSeverity::error, "an error"}};
        sequence.write_report(page, meta);
        const std::string dom = browse(page, folder);
        CHECK(dom.find("in them. Frames 12 to 13: both pictures are black; check light, lens "
                       "and cable.</li>") != std::string::npos);
        CHECK(dom.find(" of 20 frames are less sure: errors may be larger in them. ") !=
              std::string::npos);
        CHECK(dom.find("When frames are lost</dt>") != std::string::npos);
        // Losses, then notes by their weight.
        const std::size_t lost = dom.find(" of 20 frames are lost: nothing is known"),
                          error = dom.find("an error</li>"), remark = dom.find("a remark</li>");
        CHECK(lost < error);
        CHECK(error < remark);
        CHECK(remark != std::string::npos);
        CHECK(dom.find("<title>Lost: frame ") != std::string::npos);
        CHECK(dom.find("data-head=\"Median, mm\"") != std::string::npos);
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
            const std::size_t folded = dom.find("<details id=\"engineers\">");
            REQUIRE(folded != std::string::npos);
            CHECK(dom.find("<div class=\"u-title\">State</div>") < folded);
            CHECK(dom.find("<div class=\"u-title\">Residual</div>") == std::string::npos);
            CHECK(dom.find("expected error</option>") != std::string::npos);
            CHECK(dom.find("data-ellipsoids=\"0\"") == std::string::npos);
            CHECK(dom.find("data-ellipsoids=") != std::string::npos);
            CHECK(dom.find("<p id=\"no-surface\" class=\"banner\" hidden=\"\">") !=
                  std::string::npos);
        }
    }
    SUBCASE("a plan") {
        const SyntheticSequence sequence(480, 270, 6);
        const auto model = std::make_shared<PlanModel>();
        model->triangles = {0, 1, 2, 0, 3, 1, 1, 3, 2, 2, 3, 0};
        model->parts = {{"tumour", 0, 4}};
        ReportWriter report(page, {}, sequence.projector());
        report.set_template(sequence.reference(), sequence.image(0));
        for (int i = 0; i < 6; ++i) {
            FrameRecord record = sequence.record(i);
            record.targets.clear();
            record.plan.model = model;
            record.plan.vertices = {0, 0, 85, 8, 0, 85, 0, 8, 85, 2, 2, 95};
            record.plan.status.assign(4, VertexStatus::extrapolated);
            record.plan.expected_error_mm.assign(4, 0.5f);
            record.plan.targets = {PointEstimate{}};
            report.add(sequence.image(i), record);
        }
        report.finish();
        const std::string dom = browse(page, folder);
        // As in the live view.
        CHECK(dom.find("<th scope=\"col\">Not placed</th>") != std::string::npos);
        CHECK(dom.find("</span>not placed</span>") != std::string::npos);
        if (!is_plain(read_page(page))) {
            CHECK(dom.find("data-plan=\"4\"") != std::string::npos);
            CHECK(dom.find("background: #ec5cf6\"></span>tumour</span>") != std::string::npos);
            CHECK(dom.find("id=\"plan-control\"><") != std::string::npos);
        }
    }
    SUBCASE("a plan with a part inside another one") {
        const SyntheticSequence sequence(480, 270, 2);
        const auto model = std::make_shared<PlanModel>();
        model->triangles = {0, 1, 2, 0, 3, 1, 1, 3, 2, 2, 3, 0, 4, 5, 6, 4, 7, 5, 5, 7, 6, 6, 7, 4};
        model->parts = {{"organ", 0, 4}, {"tumour", 4, 4}};
        ReportWriter report(page, {}, sequence.projector());
        report.set_template(sequence.reference(), sequence.image(0));
        FrameRecord record = sequence.record(0);
        record.plan.model = model;
        record.plan.vertices = {0, 0, 80, 24, 0, 80, 0, 24, 80, 6, 6, 98,
                                4, 4, 83, 8,  4, 83, 4, 8,  83, 6, 6, 87};
        record.plan.status.assign(8, VertexStatus::extrapolated);
        record.plan.expected_error_mm.assign(8, 0.5f);
        report.add(sequence.image(0), record);
        report.finish();
        std::string text = read_page(page);
        if (!is_plain(text)) {
            const std::string dom = browse(page, folder);
            CHECK(dom.find("data-plan=\"8\" data-outer=\"4\"") != std::string::npos);
            CHECK(dom.find("background: #ec5cf6\"></span>organ</span></label>") !=
                  std::string::npos);
            text.insert(text.rfind("</body>"), R"(<script>addEventListener('load', () =>
                setTimeout(() => document.querySelector('#plan-parts input').click(), 300));
            </script>)");
            std::ofstream(folder / "hidden.html") << text;
            CHECK(browse(folder / "hidden.html", folder).find("data-plan=\"4\" data-outer=\"0\"") !=
                  std::string::npos);
        }
    }
    SUBCASE("a picture that stands still, then none for 20 s") {
        const SyntheticSequence sequence(320, 240, 100);
        ReportWriter report(page, {}, sequence.projector());
        for (int i = 0; i < 100; ++i) {
            FrameRecord record = sequence.record(1);
            record.index = i;
            record.timestamp_ms = 100 * i + (i < 80 ? 0 : 20000);
            record.state = "tracking";
            record.reasons = i >= 30 && i < 60 ? "frozen" : i == 80 ? "gap" : "";
            report.add(sequence.image(1), record);
        }
        report.finish();
        const std::string dom = browse(page, folder);
        CHECK(dom.find("No picture from 7.9 to 28&nbsp;s: nothing is known") != std::string::npos);
        CHECK(dom.find("<dd class=\"note-line\">9.80 s of video</dd>") != std::string::npos);
        CHECK(dom.find("<title>No picture: 8.00 s to 28.00 s</title>") != std::string::npos);
        CHECK(dom.find("<title>No new picture: frame 35 to 60</title>") != std::string::npos);
        CHECK(dom.find("--chip: #dc2626\">No new picture</span> 25 (25.0 %)") != std::string::npos);
        CHECK(dom.find("Followed</dt><dd>75.0 %</dd>") != std::string::npos);
        // The lines of a point: before the gap and after it.
        const std::size_t path = dom.find("<path d=\"M", dom.find("aria-label=\"Expected error"));
        const std::string line = dom.substr(path, dom.find(" fill=", path) - path);
        CHECK(std::count(line.begin(), line.end(), 'M') == 2);
    }
    SUBCASE("what is followed is told apart from what is less sure, in the live view's words") {
        const SyntheticSequence sequence(320, 240, 4);
        ReportWriter report(page, {}, sequence.projector());
        for (int i = 0; i < 4; ++i) {
            FrameRecord record = sequence.record(i);
            record.state = i == 3 ? "degraded" : "tracking";
            report.add(sequence.image(i), record);
        }
        report.finish();
        const std::string dom = browse(page, folder);
        CHECK(dom.find("<dt>Followed</dt><dd>100 %</dd><dd class=\"note-line\">of all frames: "
                       "75.0 % as usual, 25.0 % less sure") != std::string::npos);
        CHECK(dom.find("<dt>Seen</dt>") != std::string::npos);
        for (const char* word : {">Observed<", ">computed<", ">tracked<", ">Tracked<"})
            CHECK(dom.find(word) == std::string::npos);
    }
    SUBCASE("an enlarged key frame lies in its window, be that narrow or low") {
        SyntheticSequence(320, 240, 4).write_report(page, {});
        std::string text = read_page(page);
        text.insert(text.rfind("</body>"), R"(<script>addEventListener('load', () => {
            document.querySelector('.picture').click();
            const image = document.querySelector('#large img');
            image.decode().then(() => setTimeout(() => {
                const box = document.querySelector('#large').getBoundingClientRect();
                const {left, right} = image.getBoundingClientRect();
                const isInside = box.top >= 0 && box.bottom <= innerHeight &&
                    left > box.left + 10 && right < box.right - 10;
                parent.postMessage(isInside ? 'inside' : 'outside', '*');
            }, 100));
        });</script>)");
        std::ofstream(folder / "enlarged.html") << text;
        std::ofstream(folder / "windows.html") << R"(<html data-ready="true"><body><script>
                onmessage = ({data}) => document.body.append(`${data};`);</script>
                <iframe src="enlarged.html" width="390" height="640"></iframe>
                <iframe src="enlarged.html" width="1280" height="600"></iframe></body></html>)";
        const std::string dom = browse(folder / "windows.html", folder);
        CHECK_MESSAGE(dom.find("inside;inside;") != std::string::npos, dom);
    }
    SUBCASE("no frame at all") {
        ReportWriter report(page, {}, SyntheticSequence(64, 48, 2).projector());
        report.finish();
        const std::string dom = browse(page, folder);
        CHECK(dom.find("aria-labelledby=\"targets-title\" hidden=\"\"") != std::string::npos);
    }
    fs::remove_all(folder);
}
