// Several threads, queues, stages and devices at once.
#include "conformance/worker/threads.hpp"

#include "conformance/cases/abi/abi.hpp"
#include "conformance/scenes/sample_job.hpp"

namespace defrec::conformance {
namespace {

std::vector<uint32_t> offered(const Session& session) {
    std::vector<uint32_t> stages;
    for (uint32_t stage = 0; stage < DEFREC_STAGE_COUNT_V1; ++stage)
        if (session.offers(stage)) stages.push_back(stage);
    return stages;
}

constexpr size_t kThreads = 4;
constexpr int kRounds = 2;

// Each thread makes what it needs and destroys it, over and over, while the others do the same.
void own_queues(CaseRun& run) {
    Session& session = run.subject();
    const std::vector<uint32_t> stages = offered(session);
    std::vector<std::vector<Bytes>> alone;
    for (const uint32_t stage : stages) alone.push_back(run_plainly(session, sample_job(stage)));
    on_threads(kThreads, [&](size_t thread) {
        for (int round = 0; round < kRounds; ++round)
            for (size_t i = 0; i < stages.size(); ++i) {
                const size_t which = (i + thread) % stages.size();
                const auto found = run_plainly(session, sample_job(stages[which]));
                require(!session.claims_repeatable() || found == alone[which],
                        stage_name(stages[which]),
                        " gave other bits while other threads used the device");
            }
    });
}

void own_devices(CaseRun& run) {
    const std::vector<uint32_t> stages = offered(run.subject());
    const StageJob job = sample_job(stages[0]);
    const auto alone = run_plainly(run.subject(), job);
    on_threads(kThreads, [&](size_t) {
        Session session(run.subject_plugin());
        const auto found = run_plainly(session, job);
        require(!session.claims_repeatable() || found == alone, stage_name(stages[0]),
                " gave other bits on a device of another instance");
    });
}

// As several trackers do: stages of one kind side by side, each with a template of its own.
void stages_side_by_side(CaseRun& run, uint32_t stage) {
    Session& session = run.subject();
    constexpr size_t kCount = 3;
    std::vector<StageJob> jobs;
    std::vector<std::vector<Bytes>> alone;
    for (size_t i = 0; i < kCount; ++i) {
        jobs.push_back(sample_job(stage, i + 1));
        alone.push_back(run_plainly(session, jobs.back()));
    }
    Queue queue(session);
    std::vector<std::vector<Buffer>> in(kCount), out(kCount), prepared(kCount);
    std::vector<std::unique_ptr<Stage>> stages;
    for (size_t i = 0; i < kCount; ++i) {
        stages.push_back(std::make_unique<Stage>(session, stage, jobs[i].params.get()));
        const auto upload = [&](const std::vector<Input>& inputs, std::vector<Buffer>& buffers) {
            for (const Input& input : inputs) {
                buffers.push_back(input.given ? Buffer(session, input.bytes.size()) : Buffer());
                if (input.given) queue.write(buffers.back(), input.bytes);
            }
        };
        upload(jobs[i].prepare, prepared[i]);
        upload(jobs[i].in, in[i]);
        for (const Output& output : jobs[i].out) out[i].push_back(Buffer(session, output.size));
        if (!prepared[i].empty()) stages[i]->prepare(queue, prepared[i]);
    }
    for (int round = 0; round < kRounds; ++round)
        for (size_t i = 0; i < kCount; ++i) stages[i]->enqueue(queue, in[i], out[i]);
    for (size_t i = 0; i < kCount; ++i) {
        Bytes found(jobs[i].out[0].size);
        queue.read(out[i][0], found);
        queue.finish();
        require(!session.claims_repeatable() || found == alone[i][0], stage_name(stage),
                " gave other bits beside other stages of its kind");
    }
    stages.clear();
}

}  // namespace

void add_abi_thread_cases(std::vector<Case>& cases) {
    add_abi_case(
        cases, "threads_own_queues",
        "Several threads, each with a queue and stages of its own, get what one alone gets.",
        own_queues);
    add_abi_case(cases, "threads_own_devices",
                 "Several instances, each on a thread of its own, get what one alone gets.",
                 own_devices);
    add_abi_stage_case(cases, "side_by_side",
                       "Stages of one kind side by side do not disturb each other.",
                       stages_side_by_side);
}

}  // namespace defrec::conformance
