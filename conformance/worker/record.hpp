// What a run of the conformance suite found: filled by the cases, read by the reports. Plain data.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace defrec::conformance {

enum class Verdict {
    passed,
    failed,
    skipped  // does not apply: the device lacks the stage, or does not claim the property; reason
             // says which
};

// One measured quantity of one case, worst of its repetitions. Both figures have a limit: the
// largest value alone says nothing of the many, a mean hides the few.
struct Metric {
    std::string name;  // "position", "disparity"
    std::string
        unit;  // "mm"; "bytes" where results are compared bit by bit, as the number that differ
    double maximum = 0, p99 = 0;
    double limit_maximum = 0, limit_p99 = 0;  // passed up to and including these
    uint64_t samples = 0;

    bool passed() const { return maximum <= limit_maximum && p99 <= limit_p99; }  // false for NaN
};

// RGB, 8 bits, row by row without gaps. For what failed: expected, found, difference.
struct Picture {
    std::string title;
    uint32_t width = 0, height = 0;
    std::vector<uint8_t> pixels;
};

struct CaseRecord {
    std::string
        id;  // "stage/stereo/padded_stride": unique, the same in every version that has the case
    std::string tier;   // "abi", "stage", "sequence", "stress"
    std::string stage;  // "stereo"; empty where the case is of no stage
    std::string title;  // one sentence: what holds if it passes
    Verdict verdict = Verdict::skipped;
    std::string reason;  // one error message: why it failed or was skipped; empty when passed
    std::vector<Metric> metrics;
    std::vector<Picture> pictures;
    uint32_t runs = 0;
    double seconds = 0;  // of all runs
};

// Who was examined, by what, where.
struct RunRecord {
    std::string suite_version;   // "2"
    std::string suite_revision;  // of the source tree; "unknown" outside of one
    bool suite_dirty = false;    // the tree had changes that no revision names
    std::string started;         // UTC, ISO 8601
    std::string command;         // arguments, without paths
    uint64_t seed = 0;           // of the order of the cases
    bool complete = false;       // every tier and every case, nothing left out by --tier or --smoke

    std::string plugin_name, plugin_version, plugin_vendor, plugin_library;  // library: file name
    std::string plugin_sha256;
    std::string device_id, device_name, device_driver;
    uint32_t device_kind = 0, device_features = 0, device_stages = 0;  // as in defrec_device_info
    std::string system;                                                // kernel and distribution
    std::string processor;                                             // as the system names it

    std::vector<CaseRecord> cases;  // in the order of their ids
};

}  // namespace defrec::conformance
