// points.csv as input: which pixels are to be followed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace defrec::cli {

struct FollowedPoint {
    std::int64_t id = 0;
    double u = 0, v = 0;                  // pixels of the left image as given
    std::optional<std::int64_t> frame{};  // whose image; none: that which gives the template
    std::string name{};                   // shown beside the point; or empty
    bool is_chosen = true;                // false: of the grid
    bool is_click = false;                // dropped where no surface is found
};

// Columns id, u, v, and frame and name, which may be missing or empty. Throws CliError(kInput)
// naming the line for duplicate ids, for numbers that are not finite and for pixels outside an
// image of this size.
std::vector<FollowedPoint> read_points(const std::filesystem::path& path, int width, int height);

// For one more point: after the greatest, or the least that is free where there is none after it.
// removed: ids of points that are no longer followed, which have rows.
std::int64_t free_id(const std::vector<FollowedPoint>& points,
                     std::span<const std::int64_t> removed = {});

// "id 3", "ids 3, 7 and 9"; of many the first few.
std::string first_ids(const std::vector<std::int64_t>& ids);

// A grid over the middle 90 % of the image, ids row by row from 0.
std::vector<FollowedPoint> grid_points(int width, int height);

}  // namespace defrec::cli
