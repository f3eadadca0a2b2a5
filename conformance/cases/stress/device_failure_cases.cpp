// Devices that fail, refuse or dawdle, by way of the relay.
#include "conformance/cases/stress/relayed.hpp"
#include "conformance/cases/stress/stress.hpp"
#include "conformance/worker/failure.hpp"

namespace defrec::conformance {
namespace {

constexpr uint32_t kAnyCall = kRelayOpen | kRelayCreate | kRelayPrepare | kRelayEnqueue |
                              kRelayTransfer | kRelaySignal | kRelayWait;
constexpr uint32_t kCallsOfFrames =
    kRelayPrepare | kRelayEnqueue | kRelayTransfer | kRelaySignal | kRelayWait;

struct Attempt {
    defrec_status status = DEFREC_OK;  // of the first call that failed
    std::string call;
    size_t frames_left = 0;                     // after it
    size_t frames_computed = 0;                 // of those
    uint32_t last_state = DEFREC_INITIALISING;  // of the last frame that was computed
};

// A tracker from the beginning to the end, going on after a frame that failed.
Attempt attempt(defrec_context context, const std::string& device_id) {
    const RenderedSequence& film = stress_sequence();
    const RigHandle rig = open_rig(context, film);
    Attempt result;
    defrec_tracker_desc desc;
    DEFREC_INIT(&desc);
    desc.device_id = device_id.c_str();
    TrackerHandle tracker;
    if (const defrec_status status =
            defrec_tracker_create(context, rig.get(), &desc, tracker.out());
        status < 0) {
        require_message("defrec_tracker_create");
        return {.status = status, .call = "defrec_tracker_create"};
    }
    for (size_t i = 0; i < film.frames.size(); ++i) {
        const JobHandle job = submit(tracker.get(), film, i);
        const defrec_status status = defrec_job_wait(job.get(), UINT64_MAX);
        if (status < 0)
            require_message("defrec_job_wait");
        else
            result.last_state = result_of(job.get(), {}).state;
        if (result.status != DEFREC_OK) {
            result.frames_computed += status == DEFREC_OK ? 1 : 0;
            require(status == DEFREC_OK || status == result.status, "frame ", i, " ended with ",
                    defrec_status_name(status), " after ", result.call, " had ended with ",
                    defrec_status_name(result.status));
        } else if (status < 0) {
            result = {.status = status,
                      .call = concat("frame ", i),
                      .frames_left = film.frames.size() - 1 - i};
        }
    }
    return result;
}

// How many of these calls a tracker makes undisturbed.
uint64_t count_calls(const Plugin& plugin, const std::string& device_id, uint32_t calls) {
    RelayCounts counts;
    RelayPlan plan;
    plan.counts = &counts;
    plan.failing = calls;
    {
        const ContextHandle context = open_relayed_context(plugin, plan);
        const Attempt undisturbed = attempt(context.get(), device_id);
        require(undisturbed.status == DEFREC_OK, "through the relay, ", undisturbed.call,
                " ended with ", defrec_status_name(undisturbed.status), ", DEFREC_OK expected");
    }
    require(counts.all_gone(),
            "devices, queues, buffers or stages were left undestroyed after an undisturbed run");
    return counts.calls;
}

// The nth of these calls fails, for n spread over all of them; each time from a new context on.
void fail_calls(CaseRun& run, uint32_t calls, defrec_status status, size_t attempts) {
    const TrackingDevice device = tracking_subject(run);
    undisturbed(run);
    const Plugin& plugin = run.subject_plugin();
    // Another tracker of the same plugin, which has nothing to do with it.
    const ContextHandle bystander = open_context(device.manifest);
    const uint64_t total = count_calls(plugin, device.device_id, calls);
    for (const uint64_t n : spread_over(total, attempts)) {
        RelayCounts counts;
        RelayPlan plan;
        plan.counts = &counts;
        plan.failing = calls;
        plan.fail_at = n;
        plan.status = status;
        CountingAllocator memory;
        {
            defrec_context_desc desc = stress_context_desc();
            memory.install(desc);
            const ContextHandle context = open_relayed_context(plugin, plan, desc);
            const Attempt failed = attempt(context.get(), device.device_id);
            const std::string when =
                concat("when call ", n, " of ", total, " to the device was answered with ",
                       defrec_status_name(status), ", ");
            require(failed.status == status, when, failed.call.empty() ? "nothing" : failed.call,
                    " ended with ", defrec_status_name(failed.status));
            const size_t computed = status == DEFREC_ERROR_DEVICE_LOST ? 0 : failed.frames_left;
            require(failed.frames_computed == computed, when, failed.frames_computed, " of the ",
                    failed.frames_left, " later frames were computed, ", computed, " expected");
            require(computed == 0 || failed.last_state == DEFREC_TRACKING, when,
                    "the last frame has state ", failed.last_state, ", tracking expected");
            require(counts.after_loss == 0, when, counts.after_loss.load(),
                    " calls other than destroying ones followed");
        }
        require(counts.all_gone(), "after call ", n, " of ", total, " was answered with ",
                defrec_status_name(status), ", ", counts.devices.load(), " devices, ",
                counts.queues.load(), " queues, ", counts.buffers.load(), " buffers and ",
                counts.stages.load(), " stages were left undestroyed");
        require(memory.live() == 0, "after call ", n, " of ", total, " was answered with ",
                defrec_status_name(status), ", ", memory.live(),
                " blocks of host memory were not given back");
    }
    require_same(run, track_in(bystander.get(), device.device_id, stress_sequence()),
                 "after the failures of others");
}

void device_lost(CaseRun& run) { fail_calls(run, kAnyCall, DEFREC_ERROR_DEVICE_LOST, 8); }
void device_out_of_memory(CaseRun& run) {
    fail_calls(run, kRelayOpen | kRelayCreate, DEFREC_ERROR_OUT_OF_MEMORY, 6);
}
void device_refuses(CaseRun& run) { fail_calls(run, kCallsOfFrames, DEFREC_ERROR_UNSUPPORTED, 6); }

void slow_device(CaseRun& run) {
    const TrackingDevice device = tracking_subject(run);
    undisturbed(run);
    const RenderedSequence& film = stress_sequence();
    RelayCounts counts;
    RelayPlan plan;
    plan.counts = &counts;
    plan.delay_ns = 30'000'000;
    {
        const ContextHandle context = open_relayed_context(run.subject_plugin(), plan);
        const RigHandle rig = open_rig(context.get(), film);
        const TrackerHandle tracker = open_tracker(context.get(), rig.get(), device.device_id);
        const JobHandle job = submit(tracker.get(), film, 0);
        const defrec_status early = defrec_job_wait(job.get(), 1'000'000);
        require(early == DEFREC_TIMEOUT, "a wait of 1 ms for a device that takes 30 ms ended with ",
                defrec_status_name(early), ", DEFREC_TIMEOUT expected");
        check_api("defrec_job_wait", defrec_job_wait(job.get(), UINT64_MAX));
        require_same(run, track_in(context.get(), device.device_id, film), "on a slow device");
    }
    require(counts.all_gone(), "devices, queues, buffers or stages were left undestroyed");
}

}  // namespace

void add_device_failure_cases(std::vector<Case>& cases) {
    add_stress_case(cases, "device_lost", kShort,
                    "A device lost at any call: a status, a sentence, nothing but destroying "
                    "calls, nothing left, others unharmed.",
                    device_lost);
    add_stress_case(
        cases, "device_out_of_memory", kLong,
        "A device without memory for a queue, buffer or stage: a status, a sentence, nothing left.",
        device_out_of_memory);
    add_stress_case(
        cases, "device_refuses", kLong,
        "A device that refuses one call: that frame fails with the status, later ones are tracked.",
        device_refuses);
    add_stress_case(cases, "slow_device", kShort,
                    "A device that takes its time: waits end in time, and results are the same.",
                    slow_device);
}

}  // namespace defrec::conformance
