// Which functions the tables of a plugin must have; the others may be NULL. The loader and the
// conformance suite ask the same list.
#pragma once
#include <utility>

#include "backends/stages/list.hpp"
#include "include/defrec_plugin.h"

namespace defrec {

// The name of the first that is NULL; nullptr: none is.
inline const char* missing_function(const defrec_plugin& table) {
    const std::pair<const char*, bool> required[] = {
        {"device_count", table.device_count != nullptr},
        {"device_info", table.device_info != nullptr},
        {"device_open", table.device_open != nullptr},
        {"device_close", table.device_close != nullptr},
        {"buffer_create", table.buffer_create != nullptr},
        {"buffer_destroy", table.buffer_destroy != nullptr},
        {"queue_create", table.queue_create != nullptr},
        {"queue_destroy", table.queue_destroy != nullptr},
        {"write", table.write != nullptr},
        {"read", table.read != nullptr},
        {"signal", table.signal != nullptr},
        {"wait", table.wait != nullptr},
        {"stage", table.stage != nullptr},
        {"shutdown", table.shutdown != nullptr},
    };
    for (const auto& [name, is_given] : required)
        if (!is_given) return name;
    if (DEFREC_HAS(&table, host_alloc) && !DEFREC_HAS(&table, host_free))
        return "host_free, though it has host_alloc";
    return nullptr;
}
inline const char* missing_function(const defrec_stage_table& table) {
    const std::pair<const char*, bool> required[] = {
        {"supports", table.supports != nullptr},
        {"create", table.create != nullptr},
        {"destroy", table.destroy != nullptr},
        {"prepare", table.prepare != nullptr || table.stage < kFirstPreparedStage},
        {"enqueue", table.enqueue != nullptr},
    };
    for (const auto& [name, is_given] : required)
        if (!is_given) return name;
    return nullptr;
}

}  // namespace defrec
