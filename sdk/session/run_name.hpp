// A name for what was tracked, in headings.
#pragma once

#include <filesystem>
#include <string>

#include "sdk/input/frame_source.hpp"

namespace defrec::cli {

// The folder that holds both views, whose own names are left and right for every recording; else
// the source as it was given, as of cameras. folder: of the results, for views that no folder but
// the root holds.
std::string run_name(const SourceOptions& source, bool is_live,
                     const std::filesystem::path& folder);

}  // namespace defrec::cli
