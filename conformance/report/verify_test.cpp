// A sound report is accepted; every way of embellishing one is refused, with an error message that
// names it. Edits here mend the digests as somebody who edits would, so that it is not the checksum
// alone which finds them.
#include "conformance/report/verify.hpp"

#include <doctest/doctest.h>

#include <fstream>
#include <iterator>

#include "conformance/report/json_report.hpp"
#include "conformance/report/report.hpp"
#include "conformance/report/sample_report.hpp"

using namespace defrec::conformance;
using nlohmann::json;

namespace {

Suite sample_suite() {
    return {"1", sample_run().cases, [](const CaseRecord&, const Metric& m) -> Limits {
                if (m.name == "error_to_truth") return {2.0, 1.0};
                if (m.name == "distance_to_reference") return {0.02, 0.01};
                return {};
            }};
}

class Submitted {
  public:
    explicit Submitted(const RunRecord& run)
        : folder_(std::filesystem::path(DEFREC_BUILD_DIR) / "conformance_verify_test") {
        std::filesystem::remove_all(folder_);
        write_report(run, folder_);
    }
    ~Submitted() { std::filesystem::remove_all(folder_); }
    const std::filesystem::path& folder() const { return folder_; }
    std::filesystem::path file(const char* name) const { return folder_ / name; }

    json read() const {
        std::ifstream in(file(kReportFile));
        return json::parse(in);
    }
    void write(const std::string& text, const char* name = kReportFile) const {
        std::ofstream(file(name), std::ios::binary) << text;
    }
    void write_mended(json report) const {
        report["digests"]["content"] = content_digest(report);
        write(file_text(report));
    }
    std::vector<std::string> violations() const { return verify_report(folder_, sample_suite()); }

  private:
    std::filesystem::path folder_;
};

void check_one(const std::vector<std::string>& violations, const std::string& part) {
    CAPTURE(part);
    REQUIRE(violations.size() == 1);
    CAPTURE(violations[0]);
    CHECK(violations[0].find(part) != std::string::npos);
}

// What is said of a sound report after one value was set and the digest mended.
void check_edit(const char* pointer, const json& value, const std::string& part) {
    const Submitted submitted(sample_run());
    json report = submitted.read();
    REQUIRE(report.contains(json::json_pointer(pointer)));
    report[json::json_pointer(pointer)] = value;
    submitted.write_mended(report);
    check_one(submitted.violations(), part);
}

}  // namespace

TEST_CASE("a sound report is accepted, as folder and as file") {
    const Submitted submitted(sample_run());
    CHECK(submitted.violations().empty());
    CHECK(verify_report(submitted.file(kReportFile), sample_suite()).empty());
}

TEST_CASE("an edit without new digests is seen") {
    const Submitted submitted(sample_run());
    json report = submitted.read();
    report["cases"][1]["metrics"][0]["maximum"] = 0.1;
    submitted.write(file_text(report));
    check_one(submitted.violations(), "digest");
}

TEST_CASE("edits with new digests") {
    check_edit("/cases/1/metrics/0/maximum", 2.5, "error_to_truth is beyond its limit");
    check_edit("/cases/1/metrics/0/p99", "NaN", "error_to_truth is beyond its limit");
    check_edit("/cases/1/metrics/0/limit_maximum", 3.0, "the suite's limits are 2.0 and 1.0");
    check_edit("/cases/2/metrics/0/limit_p99", 1.0, "the suite's limits are 0.0 and 0.0");
    check_edit("/cases/1/metrics", json::array(), "passed without a figure");
    check_edit("/cases/0/runs", 1, "was run 1 times");
    check_edit("/cases/0/title", "Nothing much.", "another tier, stage or title");
    check_edit("/cases/0/reason", "Because.", "has a reason and is passed");
    check_edit("/run/complete", false, "not complete");
    check_edit("/suite/dirty", true, "changes");
    check_edit("/suite/revision", "unknown", "nobody can tell");
    check_edit("/suite/version", "2", "suite version 2");
    check_edit("/device/stages", 0xFF, "stage/warp/position was skipped");
    check_edit("/counts/all/passed", 5, "counts");
}

TEST_CASE("a report is held against the cases that its version of the suite had") {
    const Submitted older(sample_run());
    Suite suite = sample_suite();
    suite.version = "2";
    suite.cases.push_back(sample_case("stage/zzz", "stage", "", "More."));
    suite.since["stage/zzz"] = 2;
    CHECK(verify_report(older.folder(), suite).empty());
    RunRecord run = sample_run();
    run.suite_version = "2";
    check_one(verify_report(Submitted(run).folder(), suite), "case stage/zzz is missing");
    run.suite_version = "1";
    run.cases.push_back(suite.cases.back());
    check_one(verify_report(Submitted(run).folder(), suite), "none of the suite's");
    for (const char* version : {"3", "0", "1.0", "", "-1"}) {
        run = sample_run();
        run.suite_version = version;
        CAPTURE(version);
        check_one(verify_report(Submitted(run).folder(), suite), "versions up to 2");
    }
}

TEST_CASE("a removed case, and one taken twice") {
    RunRecord run = sample_run();
    run.cases.erase(run.cases.begin() + 1);
    check_one(Submitted(run).violations(), "case sequence/heartbeat is missing");
    run = sample_run();
    run.cases.insert(run.cases.begin(), run.cases[0]);
    check_one(Submitted(run).violations(), "2 times");
    run = sample_run();
    run.cases.push_back(sample_case("stage/zzz", "stage", "", "More."));
    check_one(Submitted(run).violations(), "none of the suite's");
    run = sample_run();
    std::swap(run.cases[0], run.cases[1]);
    check_one(Submitted(run).violations(), "order");
}

TEST_CASE("a flipped verdict, and a failure that is admitted") {
    RunRecord run = sample_failed_run();
    run.cases.erase(run.cases.begin() + 1);
    run.cases.insert(run.cases.begin() + 1, sample_run().cases[1]);
    check_one(Submitted(run).violations(), "1 cases failed");
    run.cases[2].verdict = Verdict::passed;
    run.cases[2].reason.clear();
    check_one(Submitted(run).violations(), "disparity is beyond its limit");
    run.cases[2].verdict = Verdict::skipped;
    run.cases[2].reason = "Not wanted.";
    CHECK(Submitted(run).violations().size() == 2);
}

TEST_CASE("the other two files, and the library") {
    const Submitted submitted(sample_run());
    submitted.write("<testsuites/>", kJunitFile);
    check_one(submitted.violations(), "junit.xml is not");
    std::filesystem::remove(submitted.file(kJunitFile));
    check_one(submitted.violations(), "junit.xml is missing");
    check_one(verify_report(submitted.file(kReportFile), sample_suite(), submitted.file(kPageFile)),
              "which index.html has not");
}

TEST_CASE("what is no report at all") {
    const Submitted submitted(sample_run());
    check_one(verify_report(submitted.folder() / "absent", sample_suite()), "cannot read");
    submitted.write("[1, 2");
    check_one(submitted.violations(), "no JSON");
    submitted.write("{}\n");
    check_one(submitted.violations(), "has no member 'format'");
}

TEST_CASE("a member given twice, which readers take differently") {
    const Submitted submitted(sample_run());
    const std::string text = file_text(submitted.read());
    submitted.write("{\n \"format\": 7," + text.substr(1));
    check_one(submitted.violations(), "not in the form");
}
