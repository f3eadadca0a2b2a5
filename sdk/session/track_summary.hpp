// summary.json: a tracked sequence in numbers.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>

#include "sdk/client/library.hpp"
#include "sdk/live_link/transmitter.hpp"
#include "sdk/session/plan_follower.hpp"
#include "sdk/session/point_follower.hpp"
#include "sdk/session/target_follower.hpp"
#include "sdk/session/track_outputs.hpp"
#include "sdk/session/track_session.hpp"

namespace defrec::cli {

struct LinkFacts {
    Endpoint endpoint;
    LinkCounts counts;
};

struct TrackFacts {
    const TrackOptions& options;
    const Device& device;
    const StereoCalibration& calibration;
    defrec_rig_info rig;
    const FrameLog& frames;
    const PointFollower& points;
    const TargetFollower* targets;  // null without any
    const PlanFollower* plan;       // likewise
    std::span<const std::string> notes;
    bool is_one_view_twice;  // as notes say
    const LibraryRemarks& library;
    std::optional<std::int64_t> template_frame;
    const std::optional<LinkFacts>& link;  // empty without a live link
    std::optional<CameraCounts> cameras;   // empty for recorded images
    std::optional<BagFacts> bag;           // empty but for bags
    double fps;                            // of the images
    double seconds;                        // reading, tracking and drawing together
};

// As --layout has it.
const char* layout_name(Layout layout);

nlohmann::ordered_json summarise_track(const TrackFacts& facts);

// Median and 99th percentile of each stage and of the frame: {"stereo": {"median_ms": ...,
// "p99_ms": ...},
// ..., "frame": ...}.
nlohmann::ordered_json stage_statistics(const FrameLog& frames);

// The same for a person, a few lines.
std::string summary_text(const nlohmann::ordered_json& summary,
                         const std::filesystem::path& folder);

}  // namespace defrec::cli
