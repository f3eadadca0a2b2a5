// See loader.hpp. Everything that a manifest or a table claims is checked before it is used.
#include "sdk/plugin/loader.hpp"

#include <algorithm>
#include <cstring>
#include <set>

#include "backends/stages/list.hpp"
#include "sdk/base/os/kept_floating_point.hpp"
#include "sdk/base/os/platform.hpp"
#include "sdk/base/os/run_within.hpp"
#include "sdk/base/util/error.hpp"
#include "sdk/base/util/sha256.hpp"
#include "sdk/contract/enumerations.hpp"
#include "sdk/plugin/search.hpp"
#include "sdk/plugin/shared_object.hpp"
#include "sdk/plugin/table_functions.hpp"

namespace defrec {
namespace {

constexpr uint64_t kLibraryCap = uint64_t{1} << 30;
constexpr char kEntryName[] = "defrec_plugin_entry_v1";

// What the plugin's entry answered: its verdict, whatever the status.
class EntryFailure : public Error {
    using Error::Error;
};

// What the plugin's function returns; Error with the name of the function where it throws.
template <class Function, class... Args>
auto ask(const std::string& path, const char* name, Function function, Args... args) {
    try {
        const KeptFloatingPoint mode;
        return function(args...);
    } catch (...) {
        stay_if_thread_ends();
        fail(DEFREC_ERROR_PLUGIN, path, ": ", name, " threw an exception");
    }
}

std::string text_of(const char* text) {
    return text == nullptr ? std::string() : std::string(text, strnlen(text, 256));
}

void expect_unchangeable(const std::string& path) {
    const std::string who = platform::who_may_change(path);
    if (!who.empty()) fail(DEFREC_ERROR_PLUGIN, who);
}

// On a thread of its own, which is left behind where the plugin does not return from it.
std::shared_ptr<const LoadedPlugin> start(const std::shared_ptr<const Services>& services,
                                          const std::string& library,
                                          const std::shared_ptr<const platform::OpenedFile>& file,
                                          const PluginManifest& manifest) {
    const auto started = std::make_shared<std::shared_ptr<const LoadedPlugin>>();
    const std::chrono::milliseconds limit = services->plugin_deadline();
    const bool is_done = run_within(limit, [=] {
        *started =
            std::make_shared<const LoadedPlugin>(services, library, file->descriptor, manifest);
    });
    if (is_done) return *started;
    services->leave_behind();
    fail(DEFREC_ERROR_PLUGIN, library, ": did not start within ", limit.count(),
         " ms; it is left behind");
}

// Fills a candidate; throws Error with the reason of a refusal.
void load_candidate(const std::shared_ptr<const Services>& services, PluginCandidate& candidate) {
    expect_unchangeable(candidate.path);
    const PluginManifest manifest = parse_manifest(
        candidate.path, platform::read_regular_file(candidate.path, kManifestCap).bytes);
    candidate.name = manifest.name;
    candidate.version = manifest.version;
    if (manifest.abi_major != DEFREC_PLUGIN_ABI_MAJOR)
        fail(DEFREC_ERROR_VERSION, candidate.path, ": made for plugin ABI ", manifest.abi_major,
             ".", manifest.abi_minor, ", this library speaks ", DEFREC_PLUGIN_ABI_MAJOR, ".",
             DEFREC_PLUGIN_ABI_MINOR);

    const std::string folder = candidate.path.substr(0, platform::name_start(candidate.path));
    const std::string library = folder + manifest.library;
    const auto file = std::make_shared<const platform::OpenedFile>(
        platform::read_regular_file(library, kLibraryCap));
    expect_unchangeable(library);
    check_shared_object(library, file->bytes);
    const std::string hash = sha256_hex(file->bytes);
    if (hash != manifest.sha256)
        fail(DEFREC_ERROR_PLUGIN, library, ": SHA-256 is ", hash, ", the manifest says ",
             manifest.sha256, ": the file was changed or damaged");
    candidate.plugin = start(services, library, file, manifest);
    candidate.reason = candidate.plugin->left_out();
}

}  // namespace

LoadedPlugin::LoadedPlugin(std::shared_ptr<const Services> services, const std::string& path,
                           const Descriptor& file, const PluginManifest& manifest)
    : services_(std::move(services)),
      name_(manifest.name),
      host_data_{services_.get(), name_.c_str()},
      host_(make_plugin_host(host_data_)) {
    enter(path, file);
    try {
        check_table(path, manifest);
        list_devices(path);
    } catch (...) {
        shut_down();
        throw;
    }
}

LoadedPlugin::~LoadedPlugin() { shut_down(); }

void LoadedPlugin::shut_down() noexcept {
    try {
        const KeptFloatingPoint mode;
        if (DEFREC_HAS(table_, shutdown)) table_->shutdown(table_->self);
    } catch (...) {
        stay_if_thread_ends();
        services_->log(DEFREC_LOG_ERROR, name_.c_str(), "shutdown threw an exception");
    }
}

void LoadedPlugin::quarantine(size_t device, const char* call) const noexcept {
    if (quarantined_[device].exchange(true)) return;
    try {
        services_->log(DEFREC_LOG_ERROR, "sdk",
                       concat("device ", devices_[device].id, " did not answer within ",
                              services_->plugin_deadline().count(), " ms (", call,
                              "); it is quarantined, and what it holds is left behind")
                           .c_str());
    } catch (const std::bad_alloc&) {
        // Without memory nothing is logged.
    }
}

void LoadedPlugin::enter(const std::string& path, const Descriptor& file) {
    void* library = platform::open_library(file, path);
    const auto entry =
        reinterpret_cast<defrec_plugin_entry_fn>(platform::find_symbol(library, kEntryName));
    if (entry == nullptr) fail(DEFREC_ERROR_PLUGIN, path, ": does not export ", kEntryName);
    clear_plugin_error();
    const defrec_plugin* table = nullptr;
    const defrec_status status = ask(path, kEntryName, entry, &host_, &table);
    if (status < 0)
        throw EntryFailure(status,
                           concat(path, ": ", kEntryName, ": ", plugin_error_or_name(status)));
    if (table == nullptr)
        fail(DEFREC_ERROR_PLUGIN, path, ": ", kEntryName, " succeeded without a table");
    table_ = table;
}

void LoadedPlugin::check_table(const std::string& path, const PluginManifest& manifest) const {
    const defrec_plugin& table = *table_;
    if (table.struct_size < kMinTableSize)
        fail(DEFREC_ERROR_VERSION, path, ": the plugin's table has ", table.struct_size,
             " bytes, at least ", kMinTableSize, " expected");
    if (table.abi_minor != manifest.abi_minor)
        fail(DEFREC_ERROR_VERSION, path, ": the manifest says plugin ABI minor ",
             manifest.abi_minor, ", the library ", table.abi_minor);
    if (table.name == nullptr || manifest.name != table.name)
        fail(DEFREC_ERROR_PLUGIN, path, ": the library calls itself \"", text_of(table.name),
             "\", the manifest \"", manifest.name, "\"");
    if (const char* missing = missing_function(table); missing != nullptr)
        fail(DEFREC_ERROR_PLUGIN, path, ": the plugin's table has NULL for ", missing);
}

void LoadedPlugin::list_devices(const std::string& path) {
    const size_t count = ask(path, "device_count", table_->device_count, table_->self);
    if (count > kMaxDevices)
        fail(DEFREC_ERROR_PLUGIN, path, ": the plugin claims ", count, " devices, at most ",
             kMaxDevices, " are expected");
    std::set<std::string> ids;
    for (size_t i = 0; i < count; ++i) {
        std::optional<DeviceEntry> entry = describe_device(path, i);
        if (!entry.has_value()) continue;
        if (!ids.insert(entry->id).second)
            fail(DEFREC_ERROR_PLUGIN, path, ": two of the plugin's devices are called ", entry->id);
        devices_.push_back(*std::move(entry));
    }
}

std::optional<LoadedPlugin::DeviceEntry> LoadedPlugin::describe_device(const std::string& path,
                                                                       size_t index) {
    defrec_device_info info{};
    info.struct_size = sizeof info;
    clear_plugin_error();
    const defrec_status status =
        ask(path, "device_info", table_->device_info, table_->self, index, &info);
    if (status < 0) {
        const std::string reason =
            concat("device ", index, " is left out: ", plugin_error_or_name(status));
        services_->log(DEFREC_LOG_WARNING, "sdk", concat(path, ": ", reason).c_str());
        left_out_ += concat(left_out_.empty() ? concat(path, ": ") : "; ", reason);
        return std::nullopt;
    }
    DeviceEntry entry;
    entry.index = index;
    entry.id = text_of(info.id);
    entry.name = text_of(info.name);
    entry.driver = text_of(info.driver);
    entry.kind = info.kind;
    entry.stages = info.stages & kEveryStage;
    entry.features = info.features;
    entry.conformance = info.conformance;
    entry.memory_bytes = info.memory_bytes;
    if (entry.id.empty()) fail(DEFREC_ERROR_PLUGIN, path, ": device ", index, " has no id");
    for (uint32_t stage = 0; stage < DEFREC_STAGE_COUNT_V1; ++stage)
        if (entry.stages >> stage & 1) read_stage(path, stage);
    return entry;
}

void LoadedPlugin::read_stage(const std::string& path, uint32_t stage) {
    const defrec_stage_table* table = ask(path, "stage", table_->stage, table_->self, stage);
    const char* name = stage_name(stage);
    if (table == nullptr)
        fail(DEFREC_ERROR_PLUGIN, path, ": a device claims the stage ", name,
             ", but it has no table");
    if (table->struct_size < sizeof *table || table->stage != stage)
        fail(DEFREC_ERROR_PLUGIN, path, ": the table of the stage ", name,
             " has a wrong size or number");
    if (table->stage_version != 1)
        fail(DEFREC_ERROR_VERSION, path, ": the stage ", name, " follows version ",
             table->stage_version, " of its definition, this library version 1");
    if (const char* missing = missing_function(*table); missing != nullptr)
        fail(DEFREC_ERROR_PLUGIN, path, ": the table of the stage ", name, " has NULL for ",
             missing);
    stages_[stage] = table;
}

namespace {

PluginPlaces places_of(const Services& services, const defrec_context_desc& desc) {
    PluginPlaces places;
    places.given.assign(desc.plugin_paths, desc.plugin_paths + desc.plugin_path_count);
    if (desc.flags & DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS) return places;
    places.use_environment = (desc.flags & DEFREC_CONTEXT_USE_ENVIRONMENT) != 0;
    places.library_folder = platform::own_folder();
    if (places.library_folder.empty())
        services.log(DEFREC_LOG_WARNING, "sdk",
                     "the library's own folder cannot be found; plugins are not looked for there");
    return places;
}

}  // namespace

std::vector<PluginCandidate> load_plugins(const std::shared_ptr<const Services>& services,
                                          const defrec_context_desc& desc) {
    std::vector<PluginCandidate> candidates;
    for (const FoundManifest& found :
         find_manifests(places_of(*services, desc), platform::who_may_change)) {
        PluginCandidate candidate;
        candidate.path = found.path;
        candidate.name = found.path.substr(platform::name_start(found.path));
        candidate.verdict = found.verdict;
        candidate.reason = found.reason;
        if (found.verdict == DEFREC_OK) {
            const auto refuse = [&candidate](const Error& error) {
                candidate.plugin = nullptr;
                candidate.verdict = error.status();
                candidate.reason = error.what();
            };
            try {
                load_candidate(services, candidate);
                for (const PluginCandidate& other : candidates)
                    if (other.plugin != nullptr && other.name == candidate.name)
                        fail(DEFREC_ERROR_PLUGIN, candidate.path, ": a plugin called ",
                             candidate.name, " was loaded before, from ", other.path);
            } catch (const EntryFailure& error) {
                refuse(error);
            } catch (const Error& error) {
                if (error.status() == DEFREC_ERROR_OUT_OF_MEMORY)
                    throw;  // the library's own, which says nothing of the plugin
                refuse(error);
            }
        }
        if (candidate.verdict != DEFREC_OK)
            services->log(DEFREC_LOG_WARNING, "sdk", candidate.reason.c_str());
        candidates.push_back(std::move(candidate));
    }
    return candidates;
}

}  // namespace defrec
