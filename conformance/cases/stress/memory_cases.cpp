// Host memory runs out, and is given back.
#include "conformance/cases/stress/stress.hpp"
#include "conformance/worker/failure.hpp"

namespace defrec::conformance {
namespace {

constexpr size_t kMaxFailures = 24;

// From nothing to a tracker, and back to nothing. The first status that is not DEFREC_OK.
defrec_status set_up(const TrackingDevice& device, CountingAllocator& memory, const char*& call) {
    defrec_context_desc desc = stress_context_desc();
    const char* const path = device.manifest.c_str();
    desc.flags = DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS;
    desc.plugin_paths = &path;
    desc.plugin_path_count = 1;
    memory.install(desc);
    ContextHandle context;
    RigHandle rig;
    TrackerHandle tracker;
    call = "defrec_context_create";
    if (const defrec_status status = defrec_context_create(&desc, context.out()); status < 0)
        return status;
    // A plugin that has no memory for its own instance is refused, with that as the reason.
    defrec_plugin_info info;
    DEFREC_INIT(&info);
    check_api("defrec_plugin_get", defrec_plugin_get(context.get(), 0, &info));
    if (info.verdict < 0) return info.verdict;
    call = "defrec_rig_create";
    if (const defrec_status status =
            defrec_rig_create(context.get(), &stress_sequence().rig, rig.out());
        status < 0)
        return status;
    defrec_tracker_desc tracker_desc;
    DEFREC_INIT(&tracker_desc);
    tracker_desc.device_id = device.device_id.c_str();
    call = "defrec_tracker_create";
    return defrec_tracker_create(context.get(), rig.get(), &tracker_desc, tracker.out());
}

void out_of_memory_in_set_up(CaseRun& run) {
    const TrackingDevice device = tracking_subject(run);
    CountingAllocator memory;
    const char* call = "";
    check_api("the undisturbed set-up", set_up(device, memory, call));
    require(memory.live() == 0, memory.live(),
            " blocks were not given back by an undisturbed set-up");
    const uint64_t total = memory.taken();
    for (const uint64_t n : spread_over(total, kMaxFailures)) {
        memory.fail_at(n);
        const defrec_status status = set_up(device, memory, call);
        memory.fail_at(0);
        require(status == DEFREC_ERROR_OUT_OF_MEMORY, call, " answered ",
                defrec_status_name(status), " when allocation ", n, " of ", total,
                " failed, DEFREC_ERROR_OUT_OF_MEMORY expected");
        require_message(call);
        require(memory.live() == 0, memory.live(), " blocks were not given back after allocation ",
                n, " of ", total, " failed");
    }
    check_api("the set-up after the failures", set_up(device, memory, call));
}

struct Followed {
    defrec_status worst = DEFREC_OK;
    uint32_t last_state = DEFREC_INITIALISING;
};

// All frames; a frame that fails does not end it. call_after is asked after each.
template <class Between>
Followed follow(defrec_tracker tracker, const RenderedSequence& film, const Between& between) {
    Followed result;
    for (size_t i = 0; i < film.frames.size(); ++i) {
        const JobHandle job = submit(tracker, film, i);
        const defrec_status status = defrec_job_wait(job.get(), UINT64_MAX);
        if (status < 0) {
            require_message("defrec_job_wait");
            result.worst = status;
        } else {
            result.last_state = result_of(job.get(), {}).state;
        }
        between(i);
    }
    return result;
}

void out_of_memory_in_frames(CaseRun& run) {
    const TrackingDevice device = tracking_subject(run);
    const RenderedSequence& film = stress_sequence();
    CountingAllocator memory;
    defrec_context_desc desc = stress_context_desc();
    memory.install(desc);
    const auto nothing = [](size_t) {};
    {
        const ContextHandle context = open_context(device.manifest, desc);
        const RigHandle rig = open_rig(context.get(), film);
        uint64_t total = 0;
        {
            const TrackerHandle tracker = open_tracker(context.get(), rig.get(), device.device_id);
            const uint64_t before = memory.taken();
            follow(tracker.get(), film, nothing);
            total = memory.taken() - before;
        }
        const int64_t at_rest = memory.live();
        for (const uint64_t n : spread_over(total, kMaxFailures / 4)) {
            const TrackerHandle tracker = open_tracker(context.get(), rig.get(), device.device_id);
            memory.fail_at(n);
            const Followed followed = follow(tracker.get(), film, nothing);
            memory.fail_at(0);
            require(followed.worst == DEFREC_ERROR_OUT_OF_MEMORY, "the worst frame ended with ",
                    defrec_status_name(followed.worst), " when allocation ", n, " of ", total,
                    " failed, DEFREC_ERROR_OUT_OF_MEMORY expected");
            require(followed.last_state == DEFREC_TRACKING, "the tracker has state ",
                    followed.last_state, " in the last frame, after allocation ", n, " of ", total,
                    " had failed in the first, tracking expected");
        }
        require(memory.live() == at_rest, memory.live() - at_rest,
                " blocks were not given back with the trackers whose frames had no memory");
    }
    require(memory.live() == 0, memory.live(), " blocks were not given back with the context");
}

void no_allocation_in_frames(CaseRun& run) {
    const TrackingDevice device = tracking_subject(run);
    const RenderedSequence& film = stress_sequence();
    CountingAllocator memory;
    defrec_context_desc desc = stress_context_desc();
    memory.install(desc);
    const ContextHandle context = open_context(device.manifest, desc);
    const RigHandle rig = open_rig(context.get(), film);
    const TrackerHandle tracker = open_tracker(context.get(), rig.get(), device.device_id);
    uint64_t before = 0;
    follow(tracker.get(), film, [&](size_t frame) {
        const uint64_t taken = memory.taken();
        require(frame == 0 || taken == before, "frame ", frame, " took ", taken - before,
                " blocks from the host; only the frame with the template may");
        before = taken;
    });
}

}  // namespace

void add_memory_cases(std::vector<Case>& cases) {
    add_stress_case(cases, "out_of_memory_in_set_up", kShort,
                    "Without memory for the nth block of a set-up there is a status and a "
                    "sentence, no leak, and the next works.",
                    out_of_memory_in_set_up);
    add_stress_case(cases, "out_of_memory_in_frames", kLong,
                    "Without memory for the nth block of a frame the frame fails, no leak, and the "
                    "next frames are tracked.",
                    out_of_memory_in_frames);
    add_stress_case(cases, "no_allocation_in_frames", kShort,
                    "Once there is a template, frames take no memory from the host.",
                    no_allocation_in_frames);
}

}  // namespace defrec::conformance
