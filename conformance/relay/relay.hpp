// The relay: a plugin that hands every call on to another plugin in the same process, counts, and
// on request answers as a broken or a slow device would. The suite tells it through relay_arm, its
// second symbol, what the next instance is to do.
#pragma once
#include <atomic>
#include <cstdint>

#include "include/defrec_plugin.h"

namespace defrec::conformance {

enum RelayCall : uint32_t {
    kRelayOpen = 1u << 0,
    kRelayCreate = 1u << 1,  // queues, buffers, host memory, stages
    kRelayPrepare = 1u << 2,
    kRelayEnqueue = 1u << 3,
    kRelayTransfer = 1u << 4,  // write, write_in_place, read
    kRelaySignal = 1u << 5,
    kRelayWait =
        1u << 6  // without limit; how many there are with one depends on the time the device takes
};

// What came by; the suite's, and outlives the instance.
struct RelayCounts {
    std::atomic<uint64_t> calls{0};     // of the kinds that may fail
    std::atomic<uint64_t> failures{0};  // answered by the relay itself
    std::atomic<uint64_t> after_loss{
        0};  // calls of any kind but destroying ones after DEFREC_ERROR_DEVICE_LOST was answered
    std::atomic<int64_t> instances{0}, devices{0}, queues{0}, buffers{0}, host_memories{0},
        stages{0};  // alive

    bool all_gone() const {
        return instances == 0 && devices == 0 && queues == 0 && buffers == 0 &&
               host_memories == 0 && stages == 0;
    }
};

struct RelayPlan {
    defrec_plugin_entry_fn target = nullptr;
    RelayCounts* counts = nullptr;
    uint32_t failing = 0;  // mask of RelayCall: the calls that are counted
    uint64_t fail_at =
        0;  // the nth of them (1: the first) answers status instead of being handed on; 0: none
    defrec_status status = DEFREC_OK;
    uint64_t delay_ns = 0;  // how long after its signal a point in the queue is reported as
                            // reached, at the earliest
    double jitter_mm = 0;   // of the translation of every motion that lm gives
    uint64_t jitter_seed = 0;
};

// For the next instance that is made, and only for that. Exported as
// "defrec_relay_arm".
using RelayArm = void (*)(const RelayPlan& plan);

}  // namespace defrec::conformance
