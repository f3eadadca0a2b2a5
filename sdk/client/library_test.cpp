// What the program calls the library's states and reasons.
#include "sdk/client/library.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <string>
#include <vector>

using namespace defrec::cli;

namespace {

StereoCalibration calibration_with(const std::vector<double>& right_distortion) {
    StereoCalibration calibration;
    calibration.width = 640;
    calibration.height = 480;
    calibration.left = {700, 700, 320, 240, {}, "c.yaml:5: M1", "c.yaml:9: D1"};
    calibration.right = {700, 700, 320, 240, right_distortion, "c.yaml:14: M2", "c.yaml:18: D2"};
    calibration.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    calibration.translation = {-4.6, 0, 0};
    return calibration;
}

std::string refusal(const StereoCalibration& calibration) {
    ContextOptions quiet;
    quiet.quiet = true;
    try {
        make_rig(open_context(quiet), calibration);
    } catch (const CliError& error) {
        CHECK(error.code() == ExitCode::kCalibration);
        return error.what();
    }
    return "";
}

}  // namespace

TEST_CASE("row 9: distortion that is not monotone over most of the image is refused by its line") {
    for (const std::vector<double>& distortion :
         {std::vector<double>{-4, 0, 0, 0}, std::vector<double>{0, 0, 0, 9}})
        CHECK(refusal(calibration_with(distortion))
                  .find("c.yaml:18: D2: right.distortion is not "
                        "monotone") == 0);
    StereoCalibration other = calibration_with({});
    other.right.fy = 1e9;
    CHECK(refusal(other).find("c.yaml:14: M2: right.fy") == 0);
}

TEST_CASE("row 105: distortion that folds at the corners is taken") {
    CHECK(refusal(calibration_with({-1.2, 0, 0, 0})) == "");
}

TEST_CASE("a lack of memory is not taken for a fault of the input") {
    const auto code_of = [](defrec_status status) {
        try {
            require(status, ExitCode::kCalibration, "doing");
        } catch (const CliError& error) {
            return error.code();
        }
        return ExitCode::kOk;
    };
    CHECK(code_of(DEFREC_ERROR_OUT_OF_MEMORY) == ExitCode::kInternal);
    CHECK(code_of(DEFREC_ERROR_UNSUPPORTED) == ExitCode::kDevice);
    CHECK(code_of(DEFREC_ERROR_ARGUMENT) == ExitCode::kCalibration);
    CHECK(code_of(DEFREC_OK) == ExitCode::kOk);
}

TEST_CASE("names of states") {
    CHECK(std::string(state_name(DEFREC_INITIALISING)) == "initialising");
    CHECK(std::string(state_name(DEFREC_TRACKING)) == "tracking");
    CHECK(std::string(state_name(DEFREC_DEGRADED)) == "degraded");
    CHECK(std::string(state_name(DEFREC_LOST)) == "lost");
    CHECK(std::string(state_name(DEFREC_RELOCALISED)) == "relocalised");
}

TEST_CASE("names of several reasons") {
    CHECK(reason_names(0, "|") == "");
    CHECK(reason_names(DEFREC_REASON_DARK | DEFREC_REASON_NO_DEPTH | DEFREC_REASON_LOW_CONTRAST,
                       "|") == "dark|no-depth|low-contrast");
}

TEST_CASE("every reason of the C API has its name") {
    std::ifstream layout(DEFREC_SOURCE_DIR "/sdk/abi/layout.txt");
    const std::string prefix = "DEFREC_REASON_";
    int count = 0;
    for (std::string word, equals, value; layout >> word;) {
        if (word.rfind(prefix, 0) != 0) continue;
        layout >> equals >> value;
        std::string name = word.substr(prefix.size());
        std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) {
            return c == '_' ? '-' : static_cast<char>(std::tolower(c));
        });
        CHECK(reason_names(static_cast<std::uint32_t>(std::stoul(value)), "|") == name);
        ++count;
    }
    CHECK(count > 10);
}
