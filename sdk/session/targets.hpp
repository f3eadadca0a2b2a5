// targets.csv as input: places beneath the surface that are to be followed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
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

}  // namespace defrec::cli
