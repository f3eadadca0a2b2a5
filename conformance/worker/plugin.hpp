// A plugin as the suite sees it: through its files, its one symbol and its tables, with a host of
// our own. Failures of its calls are thrown as CaseFailure with the call, the status and the
// plugin's error message; table() and get() are for cases that expect a failure.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "conformance/worker/host.hpp"
#include "include/defrec_plugin.h"

namespace defrec::conformance {

// What the files say, checked as the library does before it loads a plugin (rules P2 to P7 of
// docs/backends/plugins.md).
struct PluginFiles {
    std::string manifest;  // absolute path
    std::string library;   // absolute path
    std::string name, version, sha256;
};
// path: a manifest, or a folder with exactly one. Throws Error with the reason.
PluginFiles find_plugin(const std::string& path);
// The plugin of that name in the folder of libdefrec. Throws Error.
PluginFiles find_backend(const std::string& name);
// Loads it for ever. Throws Error.
void* open_plugin_library(const std::string& path);

// The library in this process, and which of its devices is meant.
class Plugin {
  public:
    // device_id empty: the first. Loads the library; throws Error.
    Plugin(PluginFiles files, std::string device_id);

    const PluginFiles& files() const { return files_; }
    const std::string& device_id() const { return device_id_; }
    defrec_plugin_entry_fn entry() const { return entry_; }

    // What instances that have ended did wrong with their hosts since the last call, one error
    // message, empty if nothing.
    std::string take_misuse() const;
    void note_misuse(const std::string& text) const;

  private:
    PluginFiles files_;
    std::string device_id_;
    defrec_plugin_entry_fn entry_;
    mutable std::mutex mutex_;  // guards misuse_
    mutable std::string misuse_;
};

// One call of the entry, with its host; shutdown at the end. The plugin outlives it.
class Instance {
  public:
    explicit Instance(const Plugin& plugin, uint32_t threads = 2);
    ~Instance();
    Instance(const Instance&) = delete;
    Instance& operator=(const Instance&) = delete;

    const defrec_plugin& table() const { return *table_; }
    Host& host() const { return *host_; }
    // To look at after shutdown.
    std::shared_ptr<Host> share_host() const { return host_; }
    std::vector<defrec_device_info> devices() const;
    // Throws CaseFailure unless status is 0 or more, which is returned. call: "device_open".
    defrec_status check(const std::string& call, defrec_status status) const;

  private:
    const Plugin& plugin_;
    std::shared_ptr<Host> host_;
    const defrec_plugin* table_ = nullptr;
};

// An instance with the plugin's device open.
class Session {
  public:
    explicit Session(const Plugin& plugin, uint32_t threads = 2);
    ~Session();
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    const defrec_plugin& table() const { return instance_.table(); }
    Host& host() const { return instance_.host(); }
    std::shared_ptr<Host> share_host() const { return instance_.share_host(); }
    const Instance& instance() const { return instance_; }
    const defrec_device_info& info() const { return info_; }
    defrec_pdevice* device() const { return device_; }
    bool offers(uint32_t stage) const { return (info_.stages >> stage & 1) != 0; }
    bool claims_repeatable() const { return (info_.features & DEFREC_FEATURE_REPEATABLE) != 0; }
    // Skips the case where the device does not offer the stage.
    const defrec_stage_table& stage_table(uint32_t stage) const;
    defrec_status check(const std::string& call, defrec_status status) const {
        return instance_.check(call, status);
    }

  private:
    Instance instance_;
    defrec_device_info info_{};
    defrec_pdevice* device_ = nullptr;
};

// The three below belong to a session that outlives them. Movable.
class Buffer {
  public:
    Buffer() = default;
    Buffer(const Session& session, uint64_t size);
    ~Buffer();
    Buffer(Buffer&& other) noexcept { swap(other); }
    Buffer& operator=(Buffer&& other) noexcept {
        Buffer(std::move(other)).swap(*this);
        return *this;
    }
    defrec_pbuffer* get() const {
        return buffer_;
    }  // nullptr: an optional buffer that is not given
    uint64_t size() const { return size_; }

  private:
    void swap(Buffer& other) noexcept;
    const Session* session_ = nullptr;
    defrec_pbuffer* buffer_ = nullptr;
    uint64_t size_ = 0;
};

class Queue {
  public:
    explicit Queue(const Session& session);
    ~Queue();
    Queue(const Queue&) = delete;
    Queue& operator=(const Queue&) = delete;

    defrec_pqueue* get() const { return queue_; }
    void write(const Buffer& buffer, std::span<const std::byte> bytes, uint64_t offset = 0);
    // Complete after a later finish.
    void read(const Buffer& buffer, std::span<std::byte> bytes, uint64_t offset = 0);
    uint64_t signal();
    bool wait(uint64_t value, uint64_t timeout_ns);
    void finish();  // signal, and wait for it

  private:
    const Session& session_;
    defrec_pqueue* queue_ = nullptr;
};

class Stage {
  public:
    // params: complete, see complete_params.
    Stage(const Session& session, uint32_t stage, const void* params);
    ~Stage();
    Stage(const Stage&) = delete;
    Stage& operator=(const Stage&) = delete;

    defrec_pstage* get() const { return stage_; }
    bool takes_prepare() const { return table_.prepare != nullptr; }
    void prepare(Queue& queue, std::span<const Buffer> in);
    void enqueue(Queue& queue, std::span<const Buffer> in, std::span<const Buffer> out);

  private:
    const Session& session_;
    const defrec_stage_table& table_;
    defrec_pstage* stage_ = nullptr;
};

// "stereo" for DEFREC_STAGE_STEREO.
const char* stage_name(uint32_t stage);

}  // namespace defrec::conformance
