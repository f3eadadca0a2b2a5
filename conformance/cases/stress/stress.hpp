// What the cases of the stress tier share.
#pragma once
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "conformance/cases/sequence/tracking.hpp"
#include "conformance/worker/case.hpp"

namespace defrec::conformance {

// A few small frames: what is tried here is how things end, not how exact they are.
const RenderedSequence& stress_sequence();

// Skips the case where the device cannot track.
TrackingDevice tracking_subject(CaseRun& run);

// The application's allocator: counts, and fails when told to.
class CountingAllocator {
  public:
    // Sets alloc and free of desc.
    void install(defrec_context_desc& desc);
    // The nth allocation from now on (1: the next) has no memory; 0: none fails.
    void fail_at(uint64_t nth);
    uint64_t taken() const { return taken_; }  // allocations so far, failed ones included
    int64_t live() const { return live_; }     // blocks not given back

  private:
    static void* DEFREC_CALL take(void* user, size_t size, size_t alignment);
    static void DEFREC_CALL give(void* user, void* memory);

    std::atomic<uint64_t> taken_{0}, fail_at_{0};
    std::atomic<int64_t> live_{0};
};

defrec_context_desc stress_context_desc();
RigHandle open_rig(defrec_context context, const RenderedSequence& sequence);

// What is checked of every failure: an error message.
void require_message(const char* call);

// At most `most` of 1..total, the first and the last ones among them, the same each time.
std::vector<uint64_t> spread_over(uint64_t total, size_t maximum);

// The frames as the device tracks them undisturbed; computed once in a process.
const Track& undisturbed(CaseRun& run);
// Bit for bit where the device claims to be repeatable, else in state.
void require_same(CaseRun& run, const Track& found, const std::string& when);

enum class StressList { kShort, kLong };  // short: in the smoke list too
using enum StressList;
void add_stress_case(std::vector<Case>& cases, const char* name, StressList list, const char* title,
                     void (*body)(CaseRun&));
void add_memory_cases(std::vector<Case>& cases);
void add_concurrency_cases(std::vector<Case>& cases);
void add_device_failure_cases(std::vector<Case>& cases);

}  // namespace defrec::conformance
