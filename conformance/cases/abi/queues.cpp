// Queues: signal and wait.
#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>

#include "conformance/cases/abi/abi.hpp"
#include "conformance/scenes/sample_job.hpp"
#include "conformance/scenes/template_jobs.hpp"

namespace defrec::conformance {
namespace {

void signal_grows(CaseRun& run) {
    Queue queue(run.subject());
    const Buffer buffer(run.subject(), 1000);
    uint64_t last = queue.signal();
    for (int i = 0; i < 50; ++i) {
        if (i % 3 == 0) queue.write(buffer, pattern_bytes(1000, uint64_t(i)));
        const uint64_t value = queue.signal();
        require(value > last, "signal gave ", value, " after ", last);
        last = value;
    }
    require(queue.wait(last, UINT64_MAX), "a wait without limit ended before the work");
}

void not_reached(CaseRun& run) {
    Queue queue(run.subject());
    const uint64_t value = queue.signal();
    queue.finish();
    for (const uint64_t timeout : {uint64_t{0}, uint64_t{1'000'000}})
        require(!queue.wait(value + 1000, timeout), "wait for a value that no signal gave, ",
                timeout, " ns: not DEFREC_TIMEOUT");
}

void past_values(CaseRun& run) {
    Queue queue(run.subject());
    const uint64_t first = queue.signal(), second = queue.signal();
    queue.finish();
    for (const uint64_t value : {second, first, uint64_t{0}, first, second})
        for (const uint64_t timeout : {UINT64_MAX, uint64_t{0}})
            require(queue.wait(value, timeout),
                    "wait for a value that was reached long ago answered DEFREC_TIMEOUT");
}

// Work that takes a device some time.
StageJob long_job(const Session& session) {
    if (!session.offers(DEFREC_STAGE_STEREO)) {
        for (uint32_t stage = 0; stage < DEFREC_STAGE_COUNT_V1; ++stage)
            if (session.offers(stage)) return sample_job(stage);
        skip_case("the device offers no stage");
    }
    auto params = blank<defrec_stereo_params>();
    params.width = 192;
    params.height = 128;
    params.disparities = 48;
    const StereoPair pair = stereo_pair(192, 128, 5);
    return stereo_job(params, pair.left, pair.right, nullptr, nullptr, false);
}

// Buffers of a job, and a stage to run it again and again.
struct Work {
    Work(const Session& session, Queue& queue, const StageJob& job)
        : stage(session, job.stage(), job.params.get()) {
        const auto upload = [&](const std::vector<Input>& inputs, std::vector<Buffer>& buffers) {
            for (const Input& input : inputs) {
                buffers.push_back(input.given ? Buffer(session, input.bytes.size()) : Buffer());
                if (input.given) queue.write(buffers.back(), input.bytes);
            }
        };
        upload(job.prepare, prepared);
        upload(job.in, in);
        for (const Output& output : job.out)
            out.push_back(output.given ? Buffer(session, output.size) : Buffer());
        if (!prepared.empty()) stage.prepare(queue, prepared);
    }
    std::vector<Buffer> prepared, in, out;
    Stage stage;
};

void read_complete(CaseRun& run) {
    const StageJob job = long_job(run.subject());
    const Bytes expected = run_plainly(run.subject(), job)[0];
    const auto examine = [&](const char* how, const auto& wait) {
        Queue queue(run.subject());
        Work work(run.subject(), queue, job);
        for (int i = 0; i < 2; ++i) work.stage.enqueue(queue, work.in, work.out);
        queue.write(work.out[0],
                    pattern_bytes(job.out[0].size, 3));  // what a read finds that comes too early
        work.stage.enqueue(queue, work.in, work.out);
        Bytes back(job.out[0].size, std::byte{0xA5});
        queue.read(work.out[0], back);
        wait(queue, queue.signal());
        const Bytes then = back;
        std::this_thread::sleep_for(std::chrono::milliseconds(60));
        queue.finish();
        require(then == back, "a read was not complete when ", how,
                " for a later signal had ended");
        Bytes again(job.out[0].size);
        queue.read(work.out[0], again);
        queue.finish();
        require(then == again, "a read that was waited for with ", how,
                " gave other bytes than one afterwards");
        if (run.subject().claims_repeatable())
            require(then == expected, "a read after ", how,
                    " gave other bytes than the same work alone");
        run.digest(then);
    };
    examine("a wait", [](Queue& queue, uint64_t value) {
        require(queue.wait(value, UINT64_MAX), "a wait without limit ended before the work");
    });
    examine("waits of 0 ns", [](Queue& queue, uint64_t value) {
        while (!queue.wait(value, 0)) std::this_thread::yield();
    });
    examine("waits of 100 us", [](Queue& queue, uint64_t value) {
        while (!queue.wait(value, 100'000)) std::this_thread::yield();
    });
}

void wait_from_other_thread(CaseRun& run) {
    const Session& session = run.subject();
    const StageJob job = long_job(session);
    Queue queue(session);
    Work work(session, queue, job);
    for (int round = 0; round < 4; ++round) {
        work.stage.enqueue(queue, work.in, work.out);
        const uint64_t value = queue.signal();
        defrec_status status = DEFREC_ERROR_INTERNAL;
        std::thread waiter([&] { status = session.table().wait(queue.get(), value, UINT64_MAX); });
        work.stage.enqueue(queue, work.in, work.out);  // meanwhile
        waiter.join();
        require(status == DEFREC_OK, "wait on another thread answered ",
                defrec_status_name(status));
    }
    queue.finish();
}

void destroy_waits(CaseRun& run) {
    const StageJob job = long_job(run.subject());
    Bytes back(job.out[0].size, std::byte{0xA5});
    Bytes then;
    {
        std::optional<Queue> queue(std::in_place, run.subject());
        Work work(run.subject(), *queue, job);
        for (int i = 0; i < 3; ++i) work.stage.enqueue(*queue, work.in, work.out);
        queue->read(work.out[0], back);
        queue.reset();
        then = back;
        std::this_thread::sleep_for(std::chrono::milliseconds(60));
    }
    // A read that nobody waited for may be left undone, but nothing may be written any more.
    require(then == back, "queue_destroy returned before the queue's work was done");
}

// Stage, buffers, queue, in the order that the host keeps, with work on its way.
void destroy_with_work(CaseRun& run) {
    for (int round = 0; round < 3; ++round) {
        const Session session(run.subject_plugin());
        const StageJob job = long_job(session);
        Queue queue(session);
        Work work(session, queue, job);
        for (int i = 0; i < 3; ++i) work.stage.enqueue(queue, work.in, work.out);
    }
    const StageJob job = long_job(run.subject());
    run_plainly(run.subject(), job);
}

void two_queues(CaseRun& run) {
    const StageJob job = long_job(run.subject());
    Queue first(run.subject()), second(run.subject());
    Work one(run.subject(), first, job), two(run.subject(), second, job);
    Bytes a(job.out[0].size), b(job.out[0].size);
    for (int i = 0; i < 3; ++i) {
        one.stage.enqueue(first, one.in, one.out);
        two.stage.enqueue(second, two.in, two.out);
    }
    second.read(two.out[0], b);
    first.read(one.out[0], a);
    second.finish();
    first.finish();
    if (run.subject().claims_repeatable())
        require(a == b, "the same work on two queues of a device gave two results");
}

}  // namespace

void add_abi_queue_cases(std::vector<Case>& cases) {
    add_abi_case(cases, "signal_grows", "Each signal gives a larger value.", signal_grows);
    add_abi_case(cases, "wait_not_reached",
                 "A wait for what is not reached ends with DEFREC_TIMEOUT.", not_reached);
    add_abi_case(cases, "wait_past", "A wait for what was reached before ends at once.",
                 past_values);
    add_abi_case(cases, "read_complete", "A read is complete when a later signal was waited for.",
                 read_complete);
    add_abi_case(cases, "wait_other_thread", "Any thread can wait while another enqueues.",
                 wait_from_other_thread);
    add_abi_case(cases, "queue_destroy_waits", "queue_destroy waits for the queue's work.",
                 destroy_waits);
    add_abi_case(cases, "destroy_with_work",
                 "Stage, buffers and queue can be destroyed while work is on its way.",
                 destroy_with_work);
    add_abi_case(cases, "two_queues", "Two queues of a device work side by side.", two_queues);
}

}  // namespace defrec::conformance
