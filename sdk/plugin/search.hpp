// Where manifests are looked for: the application's absolute paths; the folders of
// DEFREC_PLUGIN_PATH, if the application allows it and the process has no privileges of its own;
// the folder of this library. Never the working folder.
#pragma once
#include <string>
#include <vector>

#include "include/defrec_c.h"
#include "sdk/base/os/services.hpp"

namespace defrec {

struct FoundManifest {
    std::string path;
    std::string reason;  // why it is not even read; "" otherwise
    defrec_status verdict = DEFREC_OK;
};

// In the order of the search, names of one folder sorted, each file once. Folders that anybody may
// write to are logged and reported as refused.
std::vector<FoundManifest> find_manifests(const Services& services,
                                          const defrec_context_desc& desc);

}  // namespace defrec
