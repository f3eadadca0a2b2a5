// What the live view shows of one frame: plain values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "sdk/report/record.hpp"

namespace defrec::cli {

struct ViewPoint {
    std::int64_t id = 0;
    VertexStatus status = VertexStatus::unknown;
    // Only points that are not unknown have these.
    double u = 0, v = 0;  // pixels of the left image as given
    double x = 0, y = 0, z = 0;
    double expected_error_mm = 0;
    std::string name{};      // given by the user; or empty
    bool is_chosen = false;  // by the user, not of the grid
};

// Points and targets of users that make a followed frame less sure.
struct ViewDoubts {
    static constexpr std::size_t kMostNames = 3;
    struct Named {
        std::vector<std::string> names{};  // the first ones
        std::vector<double> errors_mm{};   // theirs, where they are too large
        std::size_t count = 0;             // of all
    };
    Named large{}, targets{};  // errors that are too large
    Named lost{}, never{};     // points without a place: which had one, and which never had
    std::size_t removed = 0;   // further points, which users have removed since

    bool is_empty() const {
        return large.count + targets.count + lost.count + never.count + removed == 0;
    }
};

// One of every frame, kept for browsers that ask later.
struct ViewMoment {
    std::int64_t index = 0;
    double timestamp_ms = 0;
    std::string state, reasons;
    double frame_ms = 0, observed_share = 0;
    std::string faulty_views{};  // of which reasons speak, as of FrameRecord
    // "found" or "relocalised" a moment ago, or "resumed" after an outage; or empty.
    std::string found{};
    // Reasons of a frame before, where "degraded" is still shown for its sake; or empty.
    std::string held_reasons{};
    bool is_held = false;
    ViewDoubts doubts{};  // likewise, of that frame
    double gap_ms = 0;    // without a picture before this one, in an outage
};

// What a browser asks of the tracking.
struct ViewCommand {
    enum class Kind { kFollowPoint, kRemovePoint, kNamePoint, kRecord };
    Kind kind = Kind::kFollowPoint;
    double u = 0, v = 0;  // kFollowPoint: pixels of the left image as given
    bool is_on = false;   // kRecord
    std::int64_t id = 0;  // kRemovePoint, kNamePoint
    std::string name{};   // kNamePoint
};

}  // namespace defrec::cli
