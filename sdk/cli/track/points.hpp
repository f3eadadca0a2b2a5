// points.csv as input: which pixels of the first left image are to be followed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace defrec::cli {

struct FollowedPoint {
    std::int64_t id = 0;
    double u = 0, v = 0;  // pixels of the left image as given
};

// Columns id, u, v. Throws CliError(kInput) naming the line for duplicate ids, for numbers that are
// not finite and for pixels outside an image of this size.
std::vector<FollowedPoint> read_points(const std::filesystem::path& path, int width, int height);

// A grid over the middle 90 % of the image, ids row by row from 0.
std::vector<FollowedPoint> grid_points(int width, int height);

}  // namespace defrec::cli
