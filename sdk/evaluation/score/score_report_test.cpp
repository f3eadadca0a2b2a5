// The page of a score: its plots, and that it stands alone.
#include "sdk/evaluation/score/score_report.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace defrec::cli;

namespace {

std::size_t count_of(const std::string& text, const std::string& part) {
    std::size_t count = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
        ++count;
    return count;
}

ScoredRow row_of(const std::string& status, double error, double expected) {
    ScoredRow row;
    row.truly_visible = true;
    row.status = status;
    row.error_mm = error;
    if (!std::isnan(expected)) row.expected_mm = expected;
    return row;
}

}  // namespace

TEST_CASE("the page has three plots and needs nothing else") {
    ScoredRows rows;
    for (int i = 0; i < 40; ++i) rows.rows.push_back(row_of("tracked", 0.1, i < 20 ? 0.1 : 0.2));
    rows.rows.push_back(row_of("extrapolated", 4, 1));
    const std::string page = score_page({score_of(rows), {}}, "a<b", "c&d");
    for (const char* title : {"<h2>Reliability", "<h2>Coverage", "<h2>Sparsification"})
        CHECK(count_of(page, title) == 1);
    CHECK(page.find("tracked, 20 points: expected 0.200 mm, measured 0.100 mm") !=
          std::string::npos);
    CHECK(page.find("extrapolated, 1 points: expected 1.000 mm, measured 4.000 mm") !=
          std::string::npos);
    CHECK(count_of(page, "<circle") == 3);
    CHECK(count_of(page, "<svg") == 6);  // each with one that clips
    CHECK(count_of(page, "<svg") == count_of(page, "</svg>"));
    CHECK(page.find("<h1>a&lt;b</h1>") != std::string::npos);
    CHECK(page.find("c&amp;d") != std::string::npos);
    CHECK(count_of(page, "of the truth, 95 %") == 1);
    CHECK(page.find("of the truth, 95 %") < page.find("<svg"));
    for (const char* absent : {"nan", "inf", "http:", "https:", "src=", "<script"})
        CHECK_MESSAGE(count_of(page, absent) == 0, absent);
}

TEST_CASE("a truth in doubt is said before the verdict, and once") {
    ScoredRows rows;
    rows.rows.assign(3, row_of("tracked", 9, 0.1));
    rows.notes = {"frames are missing.", "it is of something else."};
    rows.doubt.note = rows.notes[1];
    const std::string page = score_page({score_of(rows), {}}, "a", "b");
    const std::string doubt = std::string(kDoubt) + "</strong> " + rows.doubt.note;
    CHECK(count_of(page, rows.doubt.note) == 1);
    CHECK(page.find(doubt) < page.find("of the truth, 95 %"));
    CHECK(count_of(page, "<li>frames are missing.</li>") == 1);
}

TEST_CASE(
    "a page without expected errors has the table, one without errors no number that is none") {
    ScoredRows rows;
    rows.rows.push_back(row_of("tracked", 1, NAN));
    const std::string page = score_page({score_of(rows), {}}, "a", "b");
    CHECK(count_of(page, "<h2>Reliability") == 0);
    CHECK(count_of(page, "<h2>Sparsification") == 0);
    CHECK(page.find("errors in mm") != std::string::npos);
    rows.rows = {row_of("tracked", 0, 0.1), row_of("tracked", 0, 0)};
    CHECK(count_of(score_page({score_of(rows), {}}, "a", "b"), "nan") == 0);
}
