// Files with poses: CSV by name of its columns, and trajectories of the TUM benchmark (J. Sturm et
// al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012).
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace defrec::cli {

enum class PoseUnit { kMillimetre, kCentimetre, kMetre };
const char* name_of(PoseUnit unit);

struct PoseFile {
    std::vector<double> times_s;
    std::vector<double> poses;  // of each [R | t], 3x4 row-major, mm
    std::size_t count() const { return times_s.size(); }
    bool is_tum = false;
    PoseUnit unit = PoseUnit::kMillimetre;  // of the file
};

// unit: of the file; without it mm of CSV and metres of TUM. is_ordered: times must grow. Throws
// CliError(kInput), with file and line.
PoseFile read_timed_poses(const std::filesystem::path& path, std::optional<PoseUnit> unit,
                          bool is_ordered);

}  // namespace defrec::cli
