// See plugin.hpp.
#include "conformance/worker/plugin.hpp"

#include <array>
#include <cstring>
#include <utility>

#include "conformance/worker/failure.hpp"
#include "conformance/worker/system.hpp"
#include "include/defrec_c.h"
#include "sdk/base/os/platform.hpp"
#include "sdk/base/util/sha256.hpp"
#include "sdk/device/device.hpp"
#include "sdk/plugin/loader.hpp"
#include "sdk/plugin/manifest.hpp"
#include "sdk/plugin/shared_object.hpp"

namespace defrec::conformance {
namespace {

constexpr uint64_t kLibraryCap = uint64_t{1} << 30;
constexpr char kEntryName[] = "defrec_plugin_entry_v1";
constexpr size_t kMaxDevices = 64;

PluginFiles read_manifest(const std::string& path) {
    PluginFiles files;
    files.manifest = platform::canonical_path(path);
    const PluginManifest manifest =
        parse_manifest(path, platform::read_regular_file(path, kManifestCap).bytes);
    if (manifest.abi_major != DEFREC_PLUGIN_ABI_MAJOR)
        fail(DEFREC_ERROR_VERSION, path, ": made for plugin ABI ", manifest.abi_major,
             ", this suite examines ", DEFREC_PLUGIN_ABI_MAJOR);
    files.name = manifest.name;
    files.version = manifest.version;
    files.library =
        files.manifest.substr(0, platform::name_start(files.manifest)) + manifest.library;
    const std::vector<unsigned char> bytes =
        platform::read_regular_file(files.library, kLibraryCap).bytes;
    check_shared_object(files.library, bytes);
    files.sha256 = sha256_hex(bytes);
    if (files.sha256 != manifest.sha256)
        fail(DEFREC_ERROR_PLUGIN, files.library, ": SHA-256 is ", files.sha256,
             ", the manifest says ", manifest.sha256);
    return files;
}

std::vector<std::string> manifests_in(const std::string& folder) {
    std::vector<std::string> paths;
    for (const std::string& name : platform::list_folder(folder))
        if (name.starts_with("defrec_plugin_") && name.ends_with(".json"))
            paths.push_back(folder + (folder.ends_with('/') ? "" : "/") + name);
    return paths;
}

std::vector<defrec_pbuffer*> pointers(std::span<const Buffer> buffers) {
    std::vector<defrec_pbuffer*> result;
    for (const Buffer& buffer : buffers) result.push_back(buffer.get());
    return result;
}

}  // namespace

const char* stage_name(uint32_t stage) { return defrec::stage_name(stage); }

// ---- files ------------------------------------------------------------------

PluginFiles find_plugin(const std::string& path) {
    switch (platform::path_kind(path)) {
        case platform::PathKind::kMissing:
            fail(DEFREC_ERROR_IO, path, ": no such file or folder");
        case platform::PathKind::kFolder: {
            const std::vector<std::string> found = manifests_in(path);
            if (found.size() != 1)
                fail(DEFREC_ERROR_ARGUMENT, path, ": ", found.size(),
                     " files defrec_plugin_*.json in this folder, one expected");
            return read_manifest(found[0]);
        }
        default:
            return read_manifest(path);
    }
}

PluginFiles find_backend(const std::string& name) {
    const std::string folder = library_folder();
    const std::string path = folder + "defrec_plugin_" + name + ".json";
    if (platform::path_kind(path) == platform::PathKind::kMissing)
        fail(DEFREC_ERROR_UNSUPPORTED, "there is no plugin called ", name, " in ", folder);
    return read_manifest(path);
}

void* open_plugin_library(const std::string& path) {
    const platform::OpenedFile file = platform::read_regular_file(path, kLibraryCap);
    return platform::open_library(file.descriptor, path);
}

// ---- library and instance ---------------------------------------------------

Plugin::Plugin(PluginFiles files, std::string device_id)
    : files_(std::move(files)), device_id_(std::move(device_id)) {
    void* library = open_plugin_library(files_.library);
    entry_ = reinterpret_cast<defrec_plugin_entry_fn>(platform::find_symbol(library, kEntryName));
    if (entry_ == nullptr)
        fail(DEFREC_ERROR_PLUGIN, files_.library, ": does not export ", kEntryName);
}

std::string Plugin::take_misuse() const {
    const std::lock_guard lock(mutex_);
    return std::exchange(misuse_, {});
}

void Plugin::note_misuse(const std::string& text) const {
    const std::lock_guard lock(mutex_);
    if (misuse_.empty()) misuse_ = text;
}

Instance::Instance(const Plugin& plugin, uint32_t threads)
    : plugin_(plugin), host_(std::make_shared<Host>(threads)) {
    const defrec_plugin* table = nullptr;
    check(kEntryName, plugin.entry()(host_->table(), &table));
    require(table != nullptr, kEntryName, " succeeded without a table");
    require(table->struct_size >= kMinTableSize, "the plugin's table has ", table->struct_size,
            " bytes, at least ", kMinTableSize, " expected");
    table_ = table;
}

Instance::~Instance() {
    if (table_ == nullptr) return;
    table_->shutdown(table_->self);
    plugin_.note_misuse(host_->misuse());
}

std::vector<defrec_device_info> Instance::devices() const {
    const size_t count = table_->device_count(table_->self);
    require(count <= kMaxDevices, "the plugin claims ", count, " devices, at most ", kMaxDevices,
            " are expected");
    std::vector<defrec_device_info> infos(count);
    for (size_t i = 0; i < count; ++i) {
        DEFREC_INIT(&infos[i]);
        check("device_info", table_->device_info(table_->self, i, &infos[i]));
    }
    return infos;
}

defrec_status Instance::check(const std::string& call, defrec_status status) const {
    if (status >= 0) return status;
    const std::string message = host_->take_error();
    fail_case(call, " answered ", defrec_status_name(status),
              message.empty() ? " without an error message" : ": ", message);
}

// ---- session ----------------------------------------------------------------

Session::Session(const Plugin& plugin, uint32_t threads) : instance_(plugin, threads) {
    const std::vector<defrec_device_info> infos = instance_.devices();
    require(!infos.empty(), "the plugin has no device");
    size_t index = 0;
    if (!plugin.device_id().empty())
        while (index < infos.size() && plugin.device_id() != infos[index].id) ++index;
    require(index < infos.size(), "the plugin has no device called ", plugin.device_id());
    info_ = infos[index];
    check("device_open", table().device_open(table().self, index, &device_));
    require(device_ != nullptr, "device_open succeeded without a device");
}

Session::~Session() {
    if (device_ != nullptr) table().device_close(device_);
}

const defrec_stage_table& Session::stage_table(uint32_t stage) const {
    if (!offers(stage)) skip_case("the device does not offer the stage ", stage_name(stage));
    const defrec_stage_table* stages = table().stage(table().self, stage);
    require(stages != nullptr, "the device claims the stage ", stage_name(stage),
            ", but the plugin has no table for it");
    return *stages;
}

// ---- buffer, queue, stage ---------------------------------------------------

Buffer::Buffer(const Session& session, uint64_t size) : session_(&session), size_(size) {
    const defrec_plugin& table = session.table();
    session.check("buffer_create", table.buffer_create(session.device(), size, &buffer_));
    require(buffer_ != nullptr, "buffer_create succeeded without a buffer");
}

Buffer::~Buffer() {
    if (buffer_ != nullptr) session_->table().buffer_destroy(buffer_);
}

void Buffer::swap(Buffer& other) noexcept {
    std::swap(session_, other.session_);
    std::swap(buffer_, other.buffer_);
    std::swap(size_, other.size_);
}

Queue::Queue(const Session& session) : session_(session) {
    session.check("queue_create", session.table().queue_create(session.device(), &queue_));
    require(queue_ != nullptr, "queue_create succeeded without a queue");
}

Queue::~Queue() { session_.table().queue_destroy(queue_); }

void Queue::write(const Buffer& buffer, std::span<const std::byte> bytes, uint64_t offset) {
    session_.check(
        "write", session_.table().write(queue_, buffer.get(), offset, bytes.data(), bytes.size()));
}

void Queue::read(const Buffer& buffer, std::span<std::byte> bytes, uint64_t offset) {
    session_.check("read",
                   session_.table().read(queue_, buffer.get(), offset, bytes.data(), bytes.size()));
}

uint64_t Queue::signal() {
    uint64_t value = 0;
    session_.check("signal", session_.table().signal(queue_, &value));
    return value;
}

bool Queue::wait(uint64_t value, uint64_t timeout_ns) {
    return session_.check("wait", session_.table().wait(queue_, value, timeout_ns)) !=
           DEFREC_TIMEOUT;
}

void Queue::finish() {
    require(wait(signal(), UINT64_MAX), "a wait without limit ended before the work");
}

Stage::Stage(const Session& session, uint32_t stage, const void* params)
    : session_(session), table_(session.stage_table(stage)) {
    const std::string name = stage_name(stage);
    // Gone once the calls have returned: what a stage needs of them it copies. Every params struct
    // begins with its size.
    uint32_t size = 0;
    std::memcpy(&size, params, sizeof size);
    const auto own = std::make_unique<uint64_t[]>((size + 7) / 8);
    std::memcpy(own.get(), params, size);
    session.check("supports of " + name, table_.supports(session.device(), own.get()));
    session.check("create of " + name, table_.create(session.device(), own.get(), &stage_));
    std::memset(own.get(), 0xDD, size);
    require(stage_ != nullptr, "create of ", name, " succeeded without a stage");
}

Stage::~Stage() {
    if (stage_ != nullptr) table_.destroy(stage_);
}

void Stage::prepare(Queue& queue, std::span<const Buffer> in) {
    require(takes_prepare(), "prepare of ", stage_name(table_.stage),
            " is NULL, though the stage has inputs that stay");
    const auto inputs = pointers(in);
    session_.check(concat("prepare of ", stage_name(table_.stage)),
                   table_.prepare(stage_, queue.get(), inputs.data(), inputs.size()));
}

void Stage::enqueue(Queue& queue, std::span<const Buffer> in, std::span<const Buffer> out) {
    const auto inputs = pointers(in), outputs = pointers(out);
    session_.check(concat("enqueue of ", stage_name(table_.stage)),
                   table_.enqueue(stage_, queue.get(), inputs.data(), inputs.size(), outputs.data(),
                                  outputs.size()));
}

}  // namespace defrec::conformance
