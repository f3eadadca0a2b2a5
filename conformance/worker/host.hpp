// The host that plugins under test get: it records what they say, counts and guards their memory,
// and fails when told to.
#pragma once
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>

#include "include/defrec_plugin.h"
#include "sdk/base/os/thread_pool.hpp"

namespace defrec::conformance {

class Host {
  public:
    // threads: how many parallel_for uses.
    explicit Host(uint32_t threads);
    Host(const Host&) = delete;
    Host& operator=(const Host&) = delete;

    const defrec_host* table() const { return &table_; }

    // What the plugin said of the last failure on this thread; empty if nothing since the last call
    // of this.
    std::string take_error();
    // The text of the last log line; empty if there was none.
    std::string last_log() const;

    // Memory that was given out and not returned.
    uint64_t live_blocks() const { return live_blocks_; }
    uint64_t live_bytes() const { return live_bytes_; }
    uint64_t allocations() const { return allocations_; }  // asked for so far, failed ones included
    // The nth allocation from now on (1: the next) and, if all_later, every one after it has no
    // memory; 0: none does.
    void fail_allocation(uint64_t nth, bool all_later = false);

    // What was wrong with the plugin's use of the host, one error message, empty if nothing: bytes
    // written before or behind a block, a block freed twice, an alignment that makes no sense.
    // Looks at the blocks that are given out, too.
    std::string misuse();

  private:
    static Host& of(void* self) { return *static_cast<Host*>(self); }
    void* allocate(size_t size, size_t alignment);
    void release(void* memory);
    struct Block {
        size_t size;
        void* start;
    };
    // The two expect mutex_ to be held.
    void note_misuse(const std::string& text);
    void check_guards(const void* memory, const Block& block);

    defrec_host table_{};
    ThreadPool pool_;
    mutable std::mutex mutex_;  // guards errors_, log_, misuse_, blocks_
    std::unordered_map<std::thread::id, std::string> errors_;
    std::string log_, misuse_;
    std::unordered_map<void*, Block> blocks_;
    std::atomic<uint64_t> live_blocks_{0}, live_bytes_{0}, allocations_{0};
    std::atomic<uint64_t> fail_at_{0};  // number of an allocation as allocations_ counts
    std::atomic<bool> fail_later_{false};
};

}  // namespace defrec::conformance
