// Whether the files that a run is to write would destroy what it reads, or each other.
#pragma once

#include "sdk/session/track_session.hpp"

namespace defrec::cli {

// Throws CliError(kUsage) where an output of the run would overwrite an input or another output, or
// where --out is the recording's own folder and holds a file of that name that no run left. Before
// anything is opened or written.
void check_outputs(const TrackOptions& options);

}  // namespace defrec::cli
