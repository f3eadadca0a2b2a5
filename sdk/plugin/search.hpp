// Where manifests are looked for: the application's absolute paths; the folders and manifests of
// DEFREC_PLUGIN_PATH, if the application allows it and the process has no privileges of its own;
// the folder of this library. Never the working folder.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "include/defrec_c.h"

namespace defrec {

// In the order of the search.
struct PluginPlaces {
    std::vector<std::string> given;  // folders or manifests
    bool use_environment = false;
    std::string library_folder;  // "": is not searched
};

struct FoundManifest {
    std::string path;
    std::string reason;  // why it is not even read; "" otherwise
    defrec_status verdict = DEFREC_OK;
};

// Why nothing in a folder is looked at; "" where it is.
using FolderRefusal = std::function<std::string(const std::string&)>;

// Names of one folder sorted, each file once.
std::vector<FoundManifest> find_manifests(const PluginPlaces& places,
                                          const FolderRefusal& refusal_of);

}  // namespace defrec
