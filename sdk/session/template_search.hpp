// Which frame of a recording gives the template that all of them are followed from.
#pragma once

#include <cstdint>
#include <optional>

#include "sdk/client/library.hpp"
#include "sdk/input/frame_source.hpp"

namespace defrec::cli {

struct FoundTemplate {
    Template surface;
    StereoFrame frame;  // that gave it
};

// The parts that a tracker for this recording is made of. Borrowed.
struct TemplateSearchInput {
    const Context& context;
    const Rig& rig;
    const defrec_tracker_desc& desc;
    const SourceOptions& source;
    ExitCode refusal;  // where the library refuses the description
};

// Tracks the recording's first frames by a tracker of its own: the library takes no template of a
// frame that cannot track itself, and gives up one that good frames do not find; a template whose
// frame shows far less than one soon after it makes room for that one's. Empty where the first
// frame gives the template, or none does.
std::optional<FoundTemplate> find_template(const TemplateSearchInput& input);

// The template of one frame. Throws CliError(kInput) where it gives none.
FoundTemplate capture_template_of(const TemplateSearchInput& input, std::int64_t frame);

}  // namespace defrec::cli
