// `defrec doctor`: looks at a recording and its calibration, and says what is wrong with them.
#pragma once

#include <string>
#include <vector>

#include "sdk/doctor/finding.hpp"
#include "sdk/doctor/track_probe.hpp"
#include "sdk/input/frame_source.hpp"
#include "sdk/io/calibration.hpp"

namespace defrec::cli {

struct DoctorOptions {
    SourceOptions source;
    std::string calibration;
    LengthUnit units = LengthUnit::kGuarded;
    ProbeOptions probe;
    bool json = false, quiet = false;
};

struct Diagnosis {
    std::size_t frames = 0;
    int width = 0, height = 0;
    std::vector<Finding> findings;  // whatever the verdict
    std::size_t found() const;
};

// Throws CliError where frames or calibration cannot be read at all.
Diagnosis diagnose(const DoctorOptions& options);
std::string diagnosis_text(const Diagnosis& diagnosis);
std::string diagnosis_json(const Diagnosis& diagnosis);

// Prints it. Returns the exit code.
int run_doctor(const DoctorOptions& options);

}  // namespace defrec::cli
