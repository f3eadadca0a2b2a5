// --config: parameters of the tracker by name.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "include/defrec_c.h"

namespace defrec::cli {

// The names that a configuration file may give; each is a field of defrec_tracker_desc.
std::vector<std::string> config_keys();

// Sets what the YAML file names. Throws CliError(kUsage) naming file, key and line; an unknown key
// names the nearest.
void read_config(const std::filesystem::path& path, defrec_tracker_desc& desc);

}  // namespace defrec::cli
