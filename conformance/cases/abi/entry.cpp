// The entry and the plugin's table.
#include <cstring>

#include "conformance/cases/abi/abi.hpp"
#include "sdk/plugin/table_functions.hpp"

namespace defrec::conformance {
namespace {

const auto* const kUntouched = reinterpret_cast<const defrec_plugin*>(uintptr_t{8});

void null_host(CaseRun& run) {
    const defrec_plugin* table = kUntouched;
    const defrec_status status = run.subject_plugin().entry()(nullptr, &table);
    require(status < 0, "the entry answered ", defrec_status_name(status),
            " to a host that is NULL, a refusal expected");
    require(table == kUntouched, "the entry refused, but wrote its output");
}

void null_out(CaseRun& run) {
    Host host(1);
    const defrec_status status = run.subject_plugin().entry()(host.table(), nullptr);
    require(status < 0, "the entry answered ", defrec_status_name(status),
            " to an output that is NULL, a refusal expected");
}

// A host has all members of minor 0; one that says it is smaller is none.
void short_host(CaseRun& run) {
    for (const size_t size :
         {size_t{0}, size_t{8}, offsetof(defrec_host, alloc), offsetof(defrec_host, concurrency)}) {
        Host host(1);
        defrec_host table = *host.table();
        table.struct_size = uint32_t(size);
        const defrec_plugin* out = kUntouched;
        const defrec_status status = run.subject_plugin().entry()(&table, &out);
        require(status < 0, "the entry answered ", defrec_status_name(status),
                " to a host table of ", size, " bytes, a refusal expected");
        require(out == kUntouched, "the entry refused a host table of ", size,
                " bytes, but wrote its output");
    }
}

// A later minor version adds members at the end.
void newer_host(CaseRun& run) {
    struct {
        defrec_host table;
        void (*added[4])();
    } newer{};
    Host host(1);
    newer.table = *host.table();
    newer.table.struct_size = sizeof newer;
    newer.table.abi_minor = DEFREC_PLUGIN_ABI_MINOR + 1;
    const defrec_plugin* table = nullptr;
    const defrec_status status = run.subject_plugin().entry()(&newer.table, &table);
    require(status >= 0 && table != nullptr, "the entry answered ", defrec_status_name(status),
            " to a host of a later minor version");
    require(table->device_count(table->self) > 0,
            "with a host of a later minor version there is no device");
    table->shutdown(table->self);
}

void table_complete(CaseRun& run) {
    const Instance instance(run.subject_plugin());
    const char* missing = missing_function(instance.table());
    require(missing == nullptr, "the plugin's table has NULL for ", missing);
}

void names(CaseRun& run) {
    const Instance instance(run.subject_plugin());
    const defrec_plugin& table = instance.table();
    const std::string& manifest = run.subject_plugin().files().name;
    require(table.name != nullptr && manifest == table.name,
            "the table's name is not the manifest's, ", manifest);
    for (const auto& [what, text] :
         {std::pair{"version", table.version}, {"vendor", table.vendor}}) {
        require(text != nullptr && text[0] != '\0', "the table has no ", what);
        require(strnlen(text, 256) < 256, "the table's ", what, " is longer than 255 bytes");
    }
}

// Every entry gives an instance of its own: one goes on when another is shut down.
void instances_independent(CaseRun& run) {
    auto first = std::make_unique<Session>(run.subject_plugin());
    const Session second(run.subject_plugin());
    require(first->table().self != second.table().self || &first->table() != &second.table(),
            "two entries gave one instance");
    first.reset();
    Queue queue(second);
    const Buffer buffer(second, 1000);
    const Bytes sent = pattern_bytes(1000, 1);
    Bytes back(1000);
    queue.write(buffer, sent);
    queue.read(buffer, back);
    queue.finish();
    require(back == sent, "a buffer of one instance changed when another instance was shut down");
}

}  // namespace

void add_abi_entry_cases(std::vector<Case>& cases) {
    add_abi_case(cases, "null_host", "The entry refuses a host that is NULL.", null_host);
    add_abi_case(cases, "null_out", "The entry refuses an output that is NULL.", null_out);
    add_abi_case(cases, "short_host", "The entry refuses a host table that lacks members.",
                 short_host);
    add_abi_case(cases, "newer_host", "The entry accepts a host of a later minor version.",
                 newer_host);
    add_abi_case(cases, "table_complete", "The plugin's table has every function.", table_complete);
    add_abi_case(cases, "names",
                 "The plugin's name is the manifest's, and it has a version and a vendor.", names);
    add_abi_case(cases, "instances_independent", "An instance goes on when another is shut down.",
                 instances_independent);
}

}  // namespace defrec::conformance
