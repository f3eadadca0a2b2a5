// Loads one plugin after its manifest and its file have been checked, or says in one sentence why not.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "include/defrec_plugin.h"
#include "sdk/services.hpp"

namespace defrec {

// A plugin's instance for one context: its table, and the host that it was given. Shut down by the destructor; the code
// stays in the process (docs/plugins.md says why).
class LoadedPlugin {
  public:
    // Throws Error with the reason of the refusal. library: absolute path, checked by the caller.
    LoadedPlugin(std::shared_ptr<const Services> services, const std::string& library, const std::string& name);
    ~LoadedPlugin();
    LoadedPlugin(const LoadedPlugin&) = delete;
    LoadedPlugin& operator=(const LoadedPlugin&) = delete;

    const std::string& name() const { return name_; }
    const defrec_plugin& table() const { return *table_; }
    const Services& services() const { return *services_; }

  private:
    std::shared_ptr<const Services> services_;
    std::string name_;
    defrec_host host_{};
    const defrec_plugin* table_ = nullptr;
};

// A manifest that was looked at.
struct PluginCandidate {
    std::string name, path, version;  // name: the manifest's, or its file name where it has none
    defrec_status verdict = DEFREC_OK;
    std::string reason;                      // "" when loaded
    std::shared_ptr<const LoadedPlugin> plugin;  // null when refused
};

// Every candidate in the order of the search. Never throws for a bad plugin; std::bad_alloc only.
std::vector<PluginCandidate> load_plugins(const std::shared_ptr<const Services>& services, const defrec_context_desc& desc);

}  // namespace defrec
