// Rendered frames in the layouts of public data sets, for `defrec evaluate` to be checked with.
#pragma once

#include <string>
#include <vector>

#include "sdk/scenes/writing/render_command.hpp"

namespace defrec::cli {

/// RenderOptions::layout may be one of these, besides "defrec".
std::vector<std::string> public_layouts();

/// As render_sequence(), whose checks have been made, for a layout that is not "defrec". Throws
/// RenderUsageError where it cannot take the scene or the size.
int render_layout(const RenderOptions& options, int frames, int threads, const ProgressFn& progress,
                  const StopFn& stop);

}  // namespace defrec::cli
