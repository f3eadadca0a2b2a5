// Every faulty plugin fails in the case that is meant for it, for the reason it is meant to, and
// passes others: a suite that fails whatever is wrong anywhere says nothing. The plugins without a
// fault pass all of these cases.
#include <doctest/doctest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

namespace fs = std::filesystem;

namespace {

struct Expected {
    std::string fault;
    std::string meant;                // the case that must fail ...
    std::string reason;               // ... with this in its reason
    std::vector<std::string> passed;  // cases that must not mind
};

const std::vector<Expected> kExpected = {
    // rectify
    {"rectify_rounds_down", "stage/rectify/other_size", "gray at", {"stage/rectify/bgr"}},
    {"rectify_highlight_radius_short",
     "stage/rectify/highlight_radius_16",
     "mask at",
     {"stage/rectify/no_saturation"}},
    {"writes_one_byte_past_end",
     "stage/rectify/gray",
     "wrote byte 0 behind the end of mask",
     {"stage/orb/flat"}},
    // stereo
    {"disparity_off_by_one",
     "stage/stereo/no_masks",
     "disparity at",
     {"stage/stereo/flat", "stage/orb/texture"}},
    {"stereo_ignores_mask", "stage/stereo/both_masks", "disparity at", {"stage/stereo/no_masks"}},
    {"stereo_writes_between_rows",
     "stage/stereo/padded_stride",
     "between rows",
     {"stage/stereo/no_masks"}},
    // orb
    {"orb_unsorted_features", "stage/orb/texture", "features[", {"stage/orb/capacity_one"}},
    {"orb_writes_past_count",
     "stage/orb/few_dots",
     "of features, which is to stay as it was",
     {"stage/orb/texture"}},
    {"orb_descriptor_bit", "stage/orb/texture", "descriptor", {"stage/orb/flat"}},
    {"orb_ignores_halvings", "stage/orb/halved_alone", "features[", {"stage/orb/texture"}},
    {"writes_its_input", "stage/orb/texture", "orb changed its input 0", {"stage/rectify/gray"}},
    // match
    {"match_tie_by_last_index", "stage/match/ties", "feature is", {"stage/match/plain"}},
    {"match_second_at_same_place", "stage/match/tracked", "second is", {"stage/match/one_feature"}},
    // align
    {"align_ignores_given_predictions",
     "stage/align/both",
     "predictions[",
     {"stage/align/motions", "stage/align/predictions"}},
    {"align_first_control_point_only",
     "stage/align/blended_motions",
     "predictions[",
     {"stage/align/motions"}},
    {"align_ignores_keep_predicted",
     "stage/align/keep_predicted",
     "observations[",
     {"stage/align/predictions"}},
    {"align_ignores_right_view", "stage/align/right_view", "predictions[", {"stage/align/motions"}},
    {"align_ignores_slopes", "stage/align/slopes", "align.matrix", {"stage/align/motions"}},
    {"align_rounding", "stage/align/predictions", "observations[", {"stage/align/flat"}},
    // ransac
    {"ransac_weights_nan_input",
     "stage/ransac/not_finite",
     "weight: maximum nan",
     {"stage/ransac/plain"}},
    {"ransac_references_off_by_one",
     "stage/ransac/one_reference",
     "weight",
     {"stage/ransac/one", "stage/ransac/none"}},
    // lm
    {"lm_float_atomics",
     "stage/lm/outliers",
     "",
     {"stage/lm/depth_alone"}},  // which bits change first is chance
    {"lm_drops_patches_term", "stage/lm/everything", "lm.", {"stage/lm/matches_alone"}},
    {"lm_forgets_a_piece", "stage/lm/pieces", "lm.", {"stage/lm/everything"}},
    {"lm_refuses_trusted_steps", "stage/lm/trusted_rise", "lm.", {"stage/lm/one_iteration"}},
    {"lm_reads_previous_frame",
     "stage/lm/started_near",
     "other bits after another frame",
     {"stage/lm/no_data"}},
    // warp
    {"warp_nearest_depth_only", "stage/warp/plain", "warp.residual", {"stage/warp/no_depth_given"}},
    {"warp_uninitialised_output",
     "stage/warp/far_away",
     "of samples as it was",
     {"stage/warp/identity"}},
    // the border
    {"buffer_not_zeroed", "abi/buffer_zeroed", "is not 0", {"abi/buffer_round_trip"}},
    {"changes_rounding_mode", "abi/environment", "floating point mode", {"abi/signal_grows"}},
    {"crashes_in_enqueue", "stage/rectify/gray", "crashed with signal", {"stage/orb/texture"}},
    {"device_id_unstable", "abi/device_ids", "other ids", {"abi/device_info"}},
    {"enqueue_allocates",
     "abi/no_allocation/warp",
     "asked the host for memory",
     {"abi/no_allocation/rectify"}},
    {"hangs_in_wait", "abi/wait_past", "did not end", {"abi/table_complete"}},
    {"imports_a_copy",
     "abi/buffer_import",
     "does not read as the memory",
     {"abi/buffer_round_trip", "abi/host_memory"}},
    {"keeps_its_params", "stage/rectify/gray", "enqueue of rectify", {"stage/orb/texture"}},
    {"keeps_prepared_buffers", "stage/match/plain", "matches[", {"stage/match/unprepared"}},
    {"leaks_memory", "abi/no_memory_left", "host memory", {"abi/no_thread_left"}},
    {"leaks_thread", "abi/no_thread_left", "threads are left over", {"abi/no_memory_left"}},
    {"read_touches_beyond", "abi/buffer_offsets", "wrote beyond", {"abi/buffer_round_trip"}},
    {"refuses_with_no_text",
     "abi/buffer_ranges",
     "without telling the host an error message",
     {"abi/buffer_offsets"}},
    {"signal_not_growing", "abi/signal_grows", "signal gave 1 after 1", {"abi/read_complete"}},
    {"succeeds_without_output",
     "abi/stage_create/rectify",
     "succeeded without a stage",
     {"abi/buffer_round_trip"}},
    {"throws_across_border", "abi/no_exception", "threw an exception", {"abi/device_ids"}},
    {"wait_returns_early",
     "abi/read_complete",
     "gave other bytes",
     {"abi/environment", "abi/signal_grows"}},
};

const std::string kBuild = DEFREC_BUILD_DIR;
constexpr int kFailed = 6, kPassed = 0;  // exit codes of defrec-conformance

struct Report {
    int exit_code;
    std::string log;
    nlohmann::json cases;

    const nlohmann::json& at(const std::string& id) const {
        for (const auto& one : cases)
            if (one.at("id") == id) return one;
        FAIL("the report has no case " << id << "\n" << log);
        throw;
    }
};

std::string text_of(const fs::path& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
}

Report examine(const std::string& plugin, const std::set<std::string>& cases) {
    const fs::path out = kBuild + "/faulty_reports/" + plugin;
    fs::remove_all(out);
    fs::create_directories(out);
    const std::string limit_s = plugin == "hangs_in_wait" ? "3" : "60";
    std::string command = "'" + kBuild + "/bin/defrec-conformance' --time-limit " + limit_s +
                          " --plugin '" + kBuild + "/faulty/defrec_plugin_" + plugin +
                          ".json' --out '" + out.string() + "'";
    for (const std::string& one : cases) command += " --case '" + one + "'";
    const fs::path log = out.string() + ".log";
    const int status = std::system((command + " >'" + log.string() + "' 2>&1").c_str());
    Report report{WIFEXITED(status) ? WEXITSTATUS(status) : -1, text_of(log),
                  nlohmann::json::array()};
    if (fs::exists(out / "report.json"))
        report.cases = nlohmann::json::parse(text_of(out / "report.json")).at("cases");
    return report;
}

}  // namespace

TEST_CASE(
    "row 49: a backend that disagrees with the reference fails the conformance case of what it "
    "does "
    "wrong, and no other") {
    for (const Expected& expected : kExpected) {
        CAPTURE(expected.fault);
        std::set<std::string> cases(expected.passed.begin(), expected.passed.end());
        cases.insert(expected.meant);
        const Report report = examine(expected.fault, cases);
        CAPTURE(report.log);
        CHECK(report.exit_code == kFailed);
        const auto& meant = report.at(expected.meant);
        CHECK(meant.at("verdict") == "failed");
        CHECK(meant.at("reason").get<std::string>().find(expected.reason) != std::string::npos);
        for (const std::string& id : expected.passed) {
            CAPTURE(id);
            CHECK(report.at(id).at("verdict") == "passed");
        }
    }
}

TEST_CASE("row 49: a backend that agrees with the reference passes all of these cases") {
    std::set<std::string> cases, of_queues;
    for (const Expected& expected : kExpected) {
        std::set<std::string> these(expected.passed.begin(), expected.passed.end());
        these.insert(expected.meant);
        cases.insert(these.begin(), these.end());
        if (expected.fault == "wait_returns_early") of_queues = these;
    }
    for (const auto& [plugin, passed] :
         {std::pair(std::string("without_fault"), cases),
          std::pair(std::string("without_fault_asynchronous"), of_queues)}) {
        CAPTURE(plugin);
        const Report report = examine(plugin, passed);
        CAPTURE(report.log);
        CHECK(report.exit_code == kPassed);
        for (const std::string& id : passed) {
            CAPTURE(id);
            CHECK(report.at(id).at("verdict") == "passed");
        }
    }
}

TEST_CASE("no faulty plugin is forgotten here") {
    std::set<std::string> expected = {"without_fault", "without_fault_asynchronous"}, found;
    for (const Expected& one : kExpected) expected.insert(one.fault);
    const std::string prefix = "defrec_plugin_";
    for (const auto& entry : fs::directory_iterator(kBuild + "/faulty"))
        if (entry.path().extension() == ".json")
            found.insert(entry.path().stem().string().substr(prefix.size()));
    CHECK(found == expected);
}
