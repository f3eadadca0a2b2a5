// Rows of the truth beside what was tracked for them.
#include "sdk/evaluation/score/scored_rows.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <unordered_map>

#include "sdk/io/csv.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

// The rectified left camera; the principal point makes no difference to distances.
struct Focal {
    double x = 0, y = 0;  // px

    double distance(const Xyz& a, const Xyz& b) const {
        if (a[2] <= 0 || b[2] <= 0) return std::numeric_limits<double>::infinity();
        return std::hypot(x * (a[0] / a[2] - b[0] / b[2]), y * (a[1] / a[2] - b[1] / b[2]));
    }
};

std::optional<Focal> read_focal(const std::filesystem::path& path) {
    std::error_code error;
    if (!std::filesystem::exists(path, error)) return {};
    constexpr std::size_t kLargestFile = 100'000'000;
    const auto json =
        nlohmann::json::parse(read_text_file(path, kLargestFile, ExitCode::kInput), nullptr, false);
    const auto length = [&](const char* name) {
        const nlohmann::json::json_pointer pointer(std::string("/rectified_camera/") + name);
        if (json.is_discarded() || !json.contains(pointer) || !json[pointer].is_number()) {
            throw CliError(ExitCode::kInput, path.string() + ": a number rectified_camera/" + name +
                                                 " was expected.");
        }
        return json[pointer].get<double>();
    };
    return Focal{length("fx"), length("fy")};
}

struct States {
    std::unordered_map<std::int64_t, std::string> of_frame;
    std::vector<std::string> order;
};

States read_states(const std::filesystem::path& path) {
    States states;
    std::error_code error;
    if (!std::filesystem::exists(path, error)) return states;
    CsvReader csv(path, {"frame", "state"});
    while (csv.next()) {
        const std::string state(csv.field(1));
        states.of_frame[csv.integer(0)] = state;
        if (std::find(states.order.begin(), states.order.end(), state) != states.order.end())
            continue;
        constexpr std::size_t kMostStates = 64;
        if (states.order.size() == kMostStates)
            csv.fail("there are more than " + std::to_string(kMostStates) + " states.");
        states.order.push_back(state);
    }
    return states;
}

}  // namespace

ScoredRows read_scored_rows(const std::filesystem::path& folder, const std::filesystem::path& truth,
                            const FrameRange& range, Unfollowed unfollowed) {
    const TrackedPositions tracked = read_tracked(folder / "points.csv");
    States states = read_states(folder / "frames.csv");
    const std::optional<Focal> focal = read_focal(folder / "summary.json");
    CsvReader csv(truth, {"frame", "id", "x", "y", "z", "visible"});

    TruthCheck check(tracked, "point", unfollowed);
    ScoredRows scored;
    scored.states = std::move(states.order);
    scored.has_pixels = focal.has_value();
    while (csv.next()) {
        const FrameAndId key{csv.integer(0), csv.integer(1)};
        const std::int64_t visible = csv.integer(5);
        if (visible != 0 && visible != 1) csv.fail("visible: 0 or 1 was expected.");
        const Xyz true_xyz{csv.number(2), csv.number(3), csv.number(4)};
        const bool is_scored = is_within(range, key.frame);
        if (!check.add(key, true_xyz, visible == 1, is_scored)) csv.fail(repeated(key));
        if (!is_scored) continue;
        ScoredRow row;
        row.frame = key.frame;
        row.is_followed = check.is_followed(key.id);
        row.truly_visible = visible == 1;
        if (const auto state = states.of_frame.find(key.frame); state != states.of_frame.end()) {
            row.state = state->second;
        }
        if (const TrackedPosition* point = find(tracked, key)) {
            row.compare(*point, true_xyz);
            if (focal) row.error_px = focal->distance(point->xyz, true_xyz);
        }
        scored.rows.push_back(std::move(row));
    }
    check.finish();
    if (scored.rows.empty())
        throw CliError(ExitCode::kInput, check.no_row_of(truth.string(), range));
    if (unfollowed == Unfollowed::kLeftOut) leave_out_unfollowed(scored.rows);
    scored.not_followed = check.not_followed();
    scored.notes = check.notes(truth.string(), "points.csv");
    scored.doubt = check.doubt(truth.string(), "points.csv");
    return scored;
}

}  // namespace defrec::cli
