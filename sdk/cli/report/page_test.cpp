// The page in a real browser (Chromium, headless): its script runs to the end and meets no error.
#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/core.hpp>
#include <string>

#include "sdk/cli/report/report.hpp"
#include "sdk/cli/report/synthetic_sequence.hpp"

namespace fs = std::filesystem;
using namespace defrec::cli;
using defrec::cli::test::SyntheticSequence;

namespace {

std::string read(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

bool have_chromium() { return std::system("command -v chromium >/dev/null 2>&1") == 0; }

/// The page's document after its script ran. Folder: empty, for the browser's profile and output.
std::string browse(const fs::path& page, const fs::path& folder) {
    const std::string command =
        "env -u LD_PRELOAD timeout 100 chromium --headless --no-sandbox --disable-gpu "
        "--use-angle=swiftshader "
        "--enable-unsafe-swiftshader --disable-background-networking --disable-component-update "
        "--disable-sync "
        "--user-data-dir='" +
        (folder / "profile").string() +
        "' --window-size=1200,3000 --virtual-time-budget=20000 "
        "--enable-logging=stderr --dump-dom 'file://" +
        page.string() + "' >'" + (folder / "dom").string() + "' 2>'" + (folder / "log").string() +
        "'";
    const int status = std::system(command.c_str());
    REQUIRE(WIFEXITED(status));
    REQUIRE(WEXITSTATUS(status) == 0);
    return read(folder / "dom");
}

void check_page(const std::string& dom, const std::string& log) {
    CHECK(dom.find("data-ready=\"true\"") != std::string::npos);
    CHECK(dom.find("data-errors") == std::string::npos);
    // Lines of the page's console carry this mark; warnings of the software renderer do as well.
    for (std::size_t at = log.find(":CONSOLE"); at != std::string::npos;
         at = log.find(":CONSOLE", at + 1)) {
        const std::string line = log.substr(at, log.find('\n', at) - at);
        CAPTURE(line);
        CHECK_FALSE(line.find("Error") != std::string::npos);
        CHECK_FALSE(line.find("Refused") != std::string::npos);
    }
}

}  // namespace

TEST_CASE("the page shows itself without an error") {
    if (!have_chromium()) {
        MESSAGE("skipped: chromium is not installed");
        return;
    }
    const fs::path folder =
        fs::temp_directory_path() / ("defrec-page-" + std::to_string(::getpid()));
    fs::create_directories(folder);
    SUBCASE("a tracked sequence") {
        const SyntheticSequence sequence(480, 270, 20);
        ReportMeta meta;
        meta.sequence = "<b>synthetic</b>";
        meta.overlay_file = "overlay.mp4";
        ReportWriter report(folder / "report.html", meta, sequence.projector());
        report.set_template(sequence.reference(), sequence.image(0));
        for (int i = 0; i < 20; ++i) report.add(sequence.image(i), sequence.record(i));
        report.finish();
        const std::string dom = browse(folder / "report.html", folder);
        check_page(dom, read(folder / "log"));
        CHECK(dom.find("&lt;b&gt;synthetic&lt;/b&gt;</h1>") != std::string::npos);
        CHECK(dom.find("class=\"uplot") != std::string::npos);
        CHECK(dom.find("expected error</option>") != std::string::npos);
        CHECK(dom.find("<p id=\"no-surface\" class=\"banner\" hidden=\"\">") != std::string::npos);
    }
    SUBCASE("no frame at all") {
        ReportWriter report(folder / "report.html", {}, SyntheticSequence(64, 48, 2).projector());
        report.finish();
        check_page(browse(folder / "report.html", folder), read(folder / "log"));
    }
    fs::remove_all(folder);
}
