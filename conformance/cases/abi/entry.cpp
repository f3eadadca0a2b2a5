// The entry and the plugin's table.
#include "conformance/cases/abi/abi.hpp"

namespace defrec::conformance {
namespace {

void table_complete(CaseRun& run) {
    const Instance instance(run.subject_plugin());
    const defrec_plugin& table = instance.table();
    require(table.abi_minor <= DEFREC_PLUGIN_ABI_MINOR, "the table's abi_minor is ", table.abi_minor, ", at most ",
            DEFREC_PLUGIN_ABI_MINOR, " expected");
    const std::pair<const char*, bool> entries[] = {
        {"device_count", table.device_count != nullptr},   {"device_info", table.device_info != nullptr},
        {"device_open", table.device_open != nullptr},     {"device_close", table.device_close != nullptr},
        {"buffer_create", table.buffer_create != nullptr}, {"buffer_destroy", table.buffer_destroy != nullptr},
        {"queue_create", table.queue_create != nullptr},   {"queue_destroy", table.queue_destroy != nullptr},
        {"write", table.write != nullptr},                 {"read", table.read != nullptr},
        {"signal", table.signal != nullptr},               {"wait", table.wait != nullptr},
        {"stage", table.stage != nullptr},                 {"shutdown", table.shutdown != nullptr},
    };
    for (const auto& [name, given] : entries) require(given, "the plugin's table has NULL for ", name);
}

}  // namespace

void add_abi_entry_cases(std::vector<Case>& cases) {
    add_abi_case(cases, "table_complete", "The plugin's table has every function.", table_complete);
}

}  // namespace defrec::conformance
