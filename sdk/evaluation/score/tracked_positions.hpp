// Where points were tracked: rows of points.csv or targets.csv.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "sdk/input/frame_source.hpp"

namespace defrec::cli {

struct FrameAndId {
    std::int64_t frame, id;
    bool operator==(const FrameAndId&) const = default;
};

struct FrameAndIdHash {
    std::size_t operator()(const FrameAndId& key) const {
        return static_cast<std::size_t>(static_cast<std::uint64_t>(key.frame) *
                                            0x9E3779B97F4A7C15u ^
                                        static_cast<std::uint64_t>(key.id) * 0xC2B2AE3D27D4EB4Fu);
    }
};

// The message on a row that stands twice.
std::string repeated(const FrameAndId& key);

using Xyz = std::array<double, 3>;  // mm
double distance(const Xyz& a, const Xyz& b);

struct TrackedPosition {
    Xyz xyz{};
    std::string status;
    std::optional<double> expected_mm;
};

// Nothing for lost points.
using TrackedPositions =
    std::unordered_map<FrameAndId, std::optional<TrackedPosition>, FrameAndIdHash>;
// Throws CliError(kInput).
TrackedPositions read_tracked(const std::filesystem::path& path);
// Null for a point that is lost or has no row.
const TrackedPosition* find(const TrackedPositions& positions, const FrameAndId& key);

// Points of a truth whose id has no row at all are left out or lost: the run was not given them, or
// the program that wrote the rows leaves lost points out. If no id has a row, they are lost.
enum class Unfollowed { kLeftOut, kLost };

// A row of a truth beside what was tracked for it.
struct ScoredPosition {
    std::int64_t frame = 0;
    bool is_followed = false;        // its id has a row in some frame
    std::string status = "lost";     // as the tracked file has it; lost without a row or position
    std::optional<double> error_mm;  // distance from the truth; nothing for lost points
    std::optional<double> expected_mm;  // nothing where none was stated

    // Fills all but the frame.
    void compare(const TrackedPosition& tracked, const Xyz& truth);
};

// Takes the rows out that are not followed, unless all are such.
template <typename Row>
void leave_out_unfollowed(std::vector<Row>& rows) {
    const auto is_followed = [](const Row& row) { return row.is_followed; };
    if (std::any_of(rows.begin(), rows.end(), is_followed))
        std::erase_if(rows, [&](const Row& row) { return !is_followed(row); });
}

bool is_within(const FrameRange& range, std::int64_t frame);

}  // namespace defrec::cli
