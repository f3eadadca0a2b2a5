// Several trackers, several threads, and handles that go in odd orders.
#include <thread>

#include "conformance/cases/stress/stress.hpp"
#include "conformance/worker/failure.hpp"
#include "conformance/worker/system.hpp"
#include "conformance/worker/threads.hpp"

namespace defrec::conformance {
namespace {

void many_trackers(CaseRun& run) {
    const TrackingDevice device = tracking_subject(run);
    undisturbed(run);
    constexpr size_t kTrackers = 8;
    const RenderedSequence& film = stress_sequence();
    const ContextHandle context = open_context(device.manifest);
    std::vector<Track> tracks(kTrackers);
    on_threads(kTrackers,
               [&](size_t i) { tracks[i] = track_in(context.get(), device.device_id, film); });
    for (size_t i = 0; i < kTrackers; ++i)
        require_same(run, tracks[i],
                     concat("with ", kTrackers, " trackers at once, in tracker ", i));
}

void many_contexts(CaseRun& run) {
    const TrackingDevice device = tracking_subject(run);
    undisturbed(run);
    constexpr size_t kContexts = 4;
    std::vector<Track> tracks(kContexts);
    on_threads(kContexts, [&](size_t i) { tracks[i] = track(device, stress_sequence()); });
    for (size_t i = 0; i < kContexts; ++i)
        require_same(run, tracks[i],
                     concat("with ", kContexts, " contexts at once, in context ", i));
}

TrackerHandle open_deep_tracker(defrec_context context, defrec_rig rig,
                                const std::string& device_id, uint32_t in_flight) {
    defrec_tracker_desc desc;
    DEFREC_INIT(&desc);
    desc.device_id = device_id.c_str();
    desc.seed = 1;
    desc.frames_in_flight = in_flight;
    TrackerHandle tracker;
    check_api("defrec_tracker_create", defrec_tracker_create(context, rig, &desc, tracker.out()));
    return tracker;
}

void odd_orders(CaseRun& run) {
    const TrackingDevice device = tracking_subject(run);
    const Track& expected = undisturbed(run);
    const RenderedSequence& film = stress_sequence();
    const size_t count = film.frames.size();
    ContextHandle context = open_context(device.manifest);
    RigHandle rig = open_rig(context.get(), film);
    TrackerHandle tracker =
        open_deep_tracker(context.get(), rig.get(), device.device_id, static_cast<uint32_t>(count));
    std::vector<JobHandle> jobs;
    for (size_t i = 0; i < count; ++i) jobs.push_back(submit(tracker.get(), film, i));
    const defrec_image image = image_of(film, film.frames[0].left);
    defrec_frame late;
    DEFREC_INIT(&late);
    late.timestamp_ns = 3600'000'000'000;  // an hour
    late.left = late.right = &image;
    JobHandle refused;
    const defrec_status full = defrec_tracker_submit(tracker.get(), &late, refused.out());
    require(full == DEFREC_ERROR_BUSY, "a frame beyond the queue's places is answered with ",
            defrec_status_name(full), ", DEFREC_ERROR_BUSY expected");
    // Waited for from the last to the first, with the parents gone already.
    context.reset();
    rig.reset();
    for (size_t i = count; i-- > 0;)
        check_api("defrec_job_wait", defrec_job_wait(jobs[i].get(), UINT64_MAX));
    tracker.reset();
    Track found;
    for (const JobHandle& job : jobs) found.frames.push_back(result_of(job.get(), {}));
    for (size_t i = 0; i < count; ++i) {
        require(found.frames[i].state == expected.frames[i].state, "frame ", i, " has state ",
                found.frames[i].state, " when all were queued at once, ", expected.frames[i].state,
                " expected");
        require(!run.subject().claims_repeatable() ||
                    found.frames[i].vertices == expected.frames[i].vertices,
                "frame ", i,
                " is not, bit for bit, what it is when frames are waited for one by one, though "
                "the device claims to be repeatable");
    }
    for (const size_t i : {1, 3, 0, 2}) jobs[i].reset();
}

// Each thread waits for every frame while it is computed, reads it and moves points with it.
void many_readers(CaseRun& run) {
    const TrackingDevice device = tracking_subject(run);
    const Track& expected = undisturbed(run);
    constexpr size_t kReaders = 4;
    const RenderedSequence& film = stress_sequence();
    const ContextHandle context = open_context(device.manifest);
    const RigHandle rig = open_rig(context.get(), film);
    const TrackerHandle tracker = open_tracker(context.get(), rig.get(), device.device_id);
    const std::vector<double> points = {0, 0, 90, 5, -5, 92};
    for (size_t i = 0; i < film.frames.size(); ++i) {
        const JobHandle job = submit(tracker.get(), film, i);
        std::vector<TrackedFrame> seen(kReaders);
        on_threads(kReaders, [&](size_t reader) {
            check_api("defrec_job_wait", defrec_job_wait(job.get(), UINT64_MAX));
            seen[reader] = result_of(job.get(), points);
        });
        for (const TrackedFrame& frame : seen) {
            require(frame.state == expected.frames[i].state, "frame ", i, " has state ",
                    frame.state, " for one of ", kReaders, " threads that read it at once, ",
                    expected.frames[i].state, " expected");
            require(frame.vertices == seen[0].vertices && frame.points == seen[0].points, "frame ",
                    i, " is not the same for ", kReaders, " threads that read it at once");
        }
    }
}

// Frames are queued and never waited for; the tracker goes while they run, and somebody waits
// meanwhile.
void destroy_while_running(CaseRun& run) {
    const TrackingDevice device = tracking_subject(run);
    undisturbed(run);
    const RenderedSequence& film = stress_sequence();
    const ContextHandle context = open_context(device.manifest);
    const RigHandle rig = open_rig(context.get(), film);
    for (size_t queued = 1; queued <= film.frames.size(); ++queued) {
        TrackerHandle tracker = open_deep_tracker(context.get(), rig.get(), device.device_id,
                                                  static_cast<uint32_t>(queued));
        std::vector<JobHandle> jobs;
        for (size_t i = 0; i < queued; ++i) jobs.push_back(submit(tracker.get(), film, i));
        std::vector<defrec_status> ends(queued);
        std::thread waiter([&] {
            for (size_t i = 0; i < queued; ++i)
                ends[i] = defrec_job_wait(jobs[i].get(), UINT64_MAX);
        });
        tracker.reset();
        waiter.join();
        for (size_t i = 0; i < queued; ++i)
            require(ends[i] == DEFREC_OK || ends[i] == DEFREC_ERROR_STATE, "frame ", i, " of ",
                    queued, " ended with ", defrec_status_name(ends[i]),
                    " when its tracker was destroyed, DEFREC_OK or DEFREC_ERROR_STATE expected");
    }
    require_same(run, track_in(context.get(), device.device_id, film),
                 "after trackers were destroyed while they ran");
}

// A context that comes and goes leaves no thread and no memory behind. The first may: drivers keep
// what they have for the process.
void nothing_left_behind(CaseRun& run) {
    const TrackingDevice device = tracking_subject(run);
    CountingAllocator memory;
    const auto once = [&] {
        defrec_context_desc desc = stress_context_desc();
        memory.install(desc);
        const ContextHandle context = open_context(device.manifest, desc);
        track_in(context.get(), device.device_id, stress_sequence());
    };
    once();
    const size_t threads = thread_count();
    once();
    const size_t left = threads_beyond(threads);
    require(left == 0, "a context that came and went left ", left, " threads behind");
    require(memory.live() == 0, "contexts that came and went left ", memory.live(),
            " blocks of host memory behind");
}

}  // namespace

void add_concurrency_cases(std::vector<Case>& cases) {
    add_stress_case(cases, "many_trackers", kShort,
                    "Eight trackers at once on one device give what one alone gives.",
                    many_trackers);
    add_stress_case(
        cases, "many_contexts", kLong,
        "Four contexts at once, each with a device of its own, give what one alone gives.",
        many_contexts);
    add_stress_case(cases, "many_readers", kShort,
                    "Threads that wait for and read one frame at once all get the same.",
                    many_readers);
    add_stress_case(cases, "odd_orders", kShort,
                    "Frames queued all at once, waited for backwards, parents destroyed first: the "
                    "same results.",
                    odd_orders);
    add_stress_case(cases, "destroy_while_running", kShort,
                    "A tracker destroyed while frames run ends them, and the device goes on.",
                    destroy_while_running);
    add_stress_case(cases, "nothing_left_behind", kShort,
                    "A context that came and went leaves no thread and no host memory.",
                    nothing_left_behind);
}

}  // namespace defrec::conformance
