// --config: what is set, and what is refused.
#include "sdk/client/tracker_config.hpp"

#include <doctest/doctest.h>

#include "sdk/io/exit_code.hpp"
#include "sdk/io/test_folder.hpp"

using namespace defrec::cli;

namespace {

std::string refusal(const std::string& text) {
    const TestFolder folder;
    defrec_tracker_desc desc;
    DEFREC_INIT(&desc);
    try {
        read_config(folder.write("tracker.yaml", text), desc);
    } catch (const CliError& error) {
        CHECK(error.code() == ExitCode::kUsage);
        return error.what();
    }
    return "accepted";
}

}  // namespace

TEST_CASE("named parameters are set and the others stay at their defaults") {
    const TestFolder folder;
    defrec_tracker_desc desc;
    DEFREC_INIT(&desc);
    read_config(folder.write("tracker.yaml",
                             "max_features: 500\narap_weight: 2.5 # stiffer\nmin_disparity: 7\n"
                             "self_calibration: correct\n"),
                desc);
    CHECK(desc.max_features == 500);
    CHECK(desc.arap_weight == 2.5F);
    CHECK(desc.min_disparity == 7);
    CHECK(desc.max_patches == 0);
    CHECK(desc.self_calibration == DEFREC_SELF_CALIBRATION_CORRECT);
}

TEST_CASE(
    "row 13: unknown and duplicate parameters and values out of range are refused with the line") {
    CHECK(refusal("max_featurs: 500\n")
              .find("tracker.yaml:1: max_featurs: this key is not known; the nearest that is: "
                    "max_features.") != std::string::npos);
    CHECK(refusal("fine_iterations: 1\nfine_iterations: 2\n").find("tracker.yaml:2") !=
          std::string::npos);
    CHECK(refusal("max_features: -1\n").find("0 to 65535") != std::string::npos);
    CHECK(refusal("max_features: 1.5\n").find("whole number") != std::string::npos);
    CHECK(refusal("arap_weight: nan\n").find("not finite") != std::string::npos);
    CHECK(refusal("self_calibration: on\n").find("is on; expected one of: report, correct, off.") !=
          std::string::npos);
    CHECK(refusal("arap_weight: [1]\n").find("a number was expected") != std::string::npos);
}
