// points.csv as input.
#include "sdk/session/points.hpp"

#include <algorithm>
#include <limits>
#include <set>

#include "sdk/io/csv.hpp"
#include "sdk/io/text.hpp"
#include "sdk/session/decisions.hpp"

namespace defrec::cli {

std::vector<FollowedPoint> read_points(const std::filesystem::path& path, int width, int height) {
    CsvReader csv(path, {"id", "u", "v"}, {"frame", "name"});
    std::vector<FollowedPoint> points;
    UniqueIds ids;
    while (csv.next()) {
        if (!parse_integer(csv.field(0)))
            csv.fail("id: '" + std::string(csv.field(0).substr(0, 40)) +
                     "' is not a whole number. Number the points; what they are called goes into a "
                     "column 'name'.");
        FollowedPoint point{csv.integer(0), csv.number(1), csv.number(2)};
        if (!csv.is_empty(3)) point.frame = csv.integer(3);
        point.name = std::string(csv.field(4));
        if (point.frame.value_or(0) < 0)
            csv.fail("frame " + std::string(csv.field(3)) + " is negative.");
        ids.add(csv, point.id);
        if (point.u < -0.5 || point.v < -0.5 || point.u > width - 0.5 || point.v > height - 0.5) {
            csv.fail("the pixel " + format_fixed(point.u, 2) + "," + format_fixed(point.v, 2) +
                     " lies outside the image of " + std::to_string(width) + "x" +
                     std::to_string(height) + ".");
        }
        points.push_back(point);
    }
    if (points.empty()) csv.fail("the file names no point.");
    return points;
}

std::int64_t free_id(const std::vector<FollowedPoint>& points,
                     std::span<const std::int64_t> removed) {
    std::set<std::int64_t> taken(removed.begin(), removed.end());
    for (const FollowedPoint& point : points) taken.insert(point.id);
    if (taken.empty() || *taken.rbegin() < 0) return 0;
    if (*taken.rbegin() < std::numeric_limits<std::int64_t>::max()) return *taken.rbegin() + 1;
    std::int64_t id = 0;
    while (taken.contains(id)) ++id;
    return id;
}

std::string first_ids(const std::vector<std::int64_t>& ids) {
    constexpr std::size_t kMost = 5;
    const std::size_t named = std::min(ids.size(), kMost);
    std::string text = ids.size() == 1 ? "id " : "ids ";
    for (std::size_t i = 0; i < named; ++i) {
        const bool is_last = i + 1 == ids.size();
        text += (i == 0 ? "" : is_last ? " and " : ", ") + std::to_string(ids[i]);
    }
    return text + (ids.size() > named ? ", ..." : "");
}

std::vector<FollowedPoint> grid_points(int width, int height) {
    using Decision = decisions::FollowedPoints;
    constexpr int kColumns = Decision::kGridColumns, kRows = Decision::kGridRows;
    const auto place = [](int i, int count, int size) {
        return (Decision::kGridMargin + (1 - 2 * Decision::kGridMargin) * i / (count - 1)) *
               (size - 1);
    };
    std::vector<FollowedPoint> points;
    for (int row = 0; row < kRows; ++row) {
        for (int column = 0; column < kColumns; ++column) {
            points.push_back({row * kColumns + column,
                              place(column, kColumns, width),
                              place(row, kRows, height),
                              {},
                              {},
                              false});
        }
    }
    return points;
}

}  // namespace defrec::cli
