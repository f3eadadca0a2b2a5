// The host's side of the plugin ABI: the table of services handed to a plugin, and the error text
// that came back.
#pragma once
#include <string>

#include "include/defrec_plugin.h"
#include "sdk/base/os/services.hpp"

namespace defrec {

// self of the host table; lives as long as the plugin.
struct PluginHostData {
    const Services* services;
    const char* source;  // the plugin's name in the log
};

defrec_host make_plugin_host(PluginHostData& self);

// The error message that a plugin gave on this thread since clear_plugin_error, else the status's
// name.
void clear_plugin_error() noexcept;
std::string plugin_error_or_name(defrec_status status);

}  // namespace defrec
