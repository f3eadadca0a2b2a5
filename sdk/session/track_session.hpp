// `defrec track`: reads frames, tracks them and writes everything that the output folder gets.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sdk/input/frame_source.hpp"
#include "sdk/io/calibration.hpp"
#include "sdk/live_link/transmitter.hpp"
#include "sdk/session/plan_options.hpp"

namespace defrec::cli {

struct TemplateOptions {
    std::string load, save;             // files; empty: none
    std::optional<std::int64_t> frame;  // of the recording; none: the program looks for it
};

// The files that are written beside the results.
struct RecordingOptions {
    bool meshes = false, overlay = true, report = true;
    bool overlay_details = false;  // control points and refused matches too
    std::string trace;             // file; empty: none
};

// An option as it was typed.
struct RecordedOption {
    std::string name;  // without --
    bool is_flag = false;
    std::optional<std::string> value;  // none: it was not given
};

struct TrackOptions {
    SourceOptions source;
    std::string calibration;
    LengthUnit units = LengthUnit::kGuarded;
    std::string out;
    std::string points;   // empty: a grid
    std::string targets;  // empty: none
    PlanOptions plan;
    std::optional<double> display_delay_ms;  // what is followed is predicted so long after a frame
    std::string backend = "auto", device;
    std::string config;             // empty: the library's defaults
    std::uint64_t deadline_ns = 0;  // of each frame, from its submission; 0: none
    bool grow = false;
    TemplateOptions surface;
    RecordingOptions recordings;
    LinkOptions link;
    bool link_image = false;                 // the left view is sent as well
    std::optional<std::uint16_t> view_port;  // of the live view; 0: any that is free
    bool realtime = false;                   // frames are taken no faster than at their own times
    unsigned threads = 0;
    std::uint64_t seed = 0;
    bool quiet = false, json = false;
    std::vector<RecordedOption> recorded{};  // all of them, for the summary
};

// Returns the exit code: 0, 3 when the input ended early, 8 when nothing was tracked, 130 when
// interrupted; in all cases the outputs hold what was tracked. Throws CliError for everything else.
int run_track(const TrackOptions& options);

}  // namespace defrec::cli
