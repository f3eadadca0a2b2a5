// Where points were tracked.
#include "sdk/evaluation/score/tracked_positions.hpp"

#include <cmath>
#include <utility>

#include "sdk/io/csv.hpp"

namespace defrec::cli {
namespace {

double not_negative(const CsvReader& csv, std::size_t column) {
    const double value = csv.number(column);
    if (value < 0) csv.fail(std::string(csv.field(column)) + " is negative.");
    return value;
}

}  // namespace

std::string repeated(const FrameAndId& key) {
    return "frame " + std::to_string(key.frame) + ", id " + std::to_string(key.id) +
           " stands here again.";
}

double distance(const Xyz& a, const Xyz& b) {
    return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

TrackedPositions read_tracked(const std::filesystem::path& path) {
    CsvReader csv(path, {"frame", "id", "x", "y", "z", "status", "expected_error_mm"});
    TrackedPositions positions;
    while (csv.next()) {
        std::optional<TrackedPosition> tracked;
        if (csv.field(5) != "lost" && !csv.is_empty(2)) {
            tracked.emplace();
            tracked->xyz = {csv.number(2), csv.number(3), csv.number(4)};
            tracked->status = csv.field(5);
            if (!csv.is_empty(6)) tracked->expected_mm = not_negative(csv, 6);
        }
        const FrameAndId key{csv.integer(0), csv.integer(1)};
        if (!positions.emplace(key, std::move(tracked)).second) csv.fail(repeated(key));
    }
    return positions;
}

const TrackedPosition* find(const TrackedPositions& positions, const FrameAndId& key) {
    const auto found = positions.find(key);
    return found != positions.end() && found->second ? &*found->second : nullptr;
}

void ScoredPosition::compare(const TrackedPosition& tracked, const Xyz& truth) {
    status = tracked.status;
    expected_mm = tracked.expected_mm;
    error_mm = distance(tracked.xyz, truth);
}

bool is_within(const FrameRange& range, std::int64_t frame) {
    return frame >= range.first && (!range.last || frame < *range.last);
}

}  // namespace defrec::cli
