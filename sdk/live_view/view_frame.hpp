// What the live view shows of one frame: plain values.
#pragma once

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

// One of every frame, kept for browsers that ask later.
struct ViewMoment {
    std::int64_t index = 0;
    double timestamp_ms = 0;
    std::string state, reasons;
    double frame_ms = 0, observed_share = 0;
    std::string faulty_views{};  // of which reasons speak, as of FrameRecord
    std::string found{};         // "found" or "relocalised" a moment ago; or empty
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
