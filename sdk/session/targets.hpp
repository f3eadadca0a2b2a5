// targets.csv as input: places beneath the surface that are to be followed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace defrec::cli {

struct Target {
    std::int64_t id = 0;
    std::array<double, 3> xyz{};    // mm, template frame
    std::optional<double> depth{};  // mm beneath the surface; only written and shown
};

// Their rows are written for each frame, so that many more would fill a disk.
inline constexpr std::size_t kMaxTargets = 100'000;

// Columns id, x, y, z, and depth, which may be missing or empty. Throws CliError(kInput) naming the
// line for duplicate ids, for numbers that are not finite, for places that are not in front of the
// camera and for more than kMaxTargets.
std::vector<Target> read_targets(const std::filesystem::path& path);

// A note on targets that cannot lie in the tissue that is followed.
struct TargetPlacesNote {
    std::string text;      // empty: all may
    bool is_most = false;  // of them; so that their unit or frame is doubtful
};
enum class TargetsOf { kFile, kPlan };
// surface: the template's vertices, mm, in the frame of the targets.
TargetPlacesNote note_on_places(const std::vector<Target>& targets,
                                const std::vector<std::array<float, 3>>& surface,
                                TargetsOf source = TargetsOf::kFile);

}  // namespace defrec::cli
