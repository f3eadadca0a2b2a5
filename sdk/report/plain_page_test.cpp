// The page of a build without npm: one script without modules, which shows all but the surface and
// the plots and says that these are missing.
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

namespace {

int count(const std::string& text, const std::string& part) {
    int found = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
        ++found;
    return found;
}

}  // namespace

TEST_CASE("the plain page says what it lacks and shows the rest") {
    const fs::path folder =
        fs::temp_directory_path() / ("defrec-plain-page-" + std::to_string(::getpid()));
    fs::create_directories(folder);
    const fs::path page = folder / "report.html";
    ReportMeta meta;
    meta.sequence = "synthetic";
    SyntheticSequence(480, 270, 20).write_report(page, meta);

    const std::string text = read_page(page);
    CHECK(is_plain(text));
    CHECK(count(text, "\nimport ") == 0);
    CHECK(count(text, "\nexport ") == 0);
    for (const char* function : {"readData", "showSummary", "showChanges", "showPictures", "ready"})
        CHECK(count(text, std::string("\nfunction ") + function + "(") == 1);
    CHECK(count(text, "Not in this report: this defrec was built without node, npm") == 1);

    if (have_chromium()) {
        const std::string dom = browse(page, folder);
        CHECK(dom.find("<h1 id=\"sequence\">synthetic</h1>") != std::string::npos);
        CHECK(count(dom, "<p class=\"note\">Not in this report") == 2);
        CHECK(count(dom, "<figure>") > 0);
        CHECK(count(dom, "class=\"depth-plot\"") == 3);
        CHECK(dom.find("<canvas") == std::string::npos);
    } else {
        MESSAGE("not shown in a browser: chromium is not installed");
    }
    fs::remove_all(folder);
}
