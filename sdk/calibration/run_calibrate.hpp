// `defrec calibrate`: a stereo rig's calibration from images of a board.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "sdk/calibration/board.hpp"
#include "sdk/calibration/stereo_solution.hpp"
#include "sdk/input/frame_source.hpp"

namespace defrec::cli {

struct CalibrateCommand {
    SourceOptions source;
    BoardDescription board;
    int coefficients = 5;    // of each lens
    double distance_mm = 0;  // of the tissue; 0: the boards' median
    std::string out, report;
    bool json = false, quiet = false;
};

struct CalibrateFindings {
    BoardRecording recording;
    StereoSolution solution;
    std::vector<std::string> faults;    // why it must not be used; empty: it may
    std::vector<std::string> warnings;  // what would make it better
    bool is_accepted() const { return faults.empty(); }
};

CalibrateFindings calibrate(const CalibrateCommand& command);
nlohmann::ordered_json calibrate_json(const CalibrateFindings& findings);
std::string calibrate_text(const CalibrateFindings& findings);

// Returns the exit code: 0 where the calibration was written, 9 where it is refused.
int run_calibrate(const CalibrateCommand& command);

}  // namespace defrec::cli
