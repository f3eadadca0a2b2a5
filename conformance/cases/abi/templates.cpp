// What prepare is given: templates that make no sense are refused; and runs after it need no more
// memory.
#include <bit>
#include <cstring>
#include <limits>

#include "conformance/cases/abi/abi.hpp"
#include "conformance/scenes/sample_job.hpp"

namespace defrec::conformance {
namespace {

struct Fault {
    const char* what;
    size_t buffer;  // of prepare
    size_t offset;  // bytes, of what is overwritten
    uint32_t bits;
};

uint32_t bits_of(float value) { return std::bit_cast<uint32_t>(value); }

std::vector<Fault> faults_of(uint32_t stage, const StageJob& job) {
    const uint32_t nan = bits_of(std::numeric_limits<float>::quiet_NaN()),
                   infinity = bits_of(std::numeric_limits<float>::infinity());
    constexpr uint32_t kMinusOne = UINT32_MAX;
    constexpr size_t kPoint = 3 * sizeof(defrec_surface_point);  // the fourth
    constexpr size_t kPatch = 2 * sizeof(defrec_patch);
    const auto point = [&](size_t buffer, uint32_t nodes) {
        return std::vector<Fault>{
            {"a point with control point -1", buffer, kPoint + offsetof(defrec_surface_point, node),
             kMinusOne},
            {"a point with a control point too many", buffer,
             kPoint + offsetof(defrec_surface_point, node) + 12, nodes},
            {"a point whose position is not a number", buffer, kPoint + 4, nan},
            {"a point whose weight is infinite", buffer,
             kPoint + offsetof(defrec_surface_point, weight) + 4, infinity}};
    };
    if (stage == DEFREC_STAGE_WARP)
        return point(0, static_cast<const defrec_warp_params*>(job.params.get())->nodes);
    if (stage == DEFREC_STAGE_ALIGN)
        return {
            {"a patch of view -1", 0, kPatch + offsetof(defrec_patch, view), kMinusOne},
            {"a patch of a view too many", 0, kPatch + offsetof(defrec_patch, view), 1},
            {"a patch with control point -1", 0, kPatch + offsetof(defrec_patch, node), kMinusOne},
            {"a patch with a control point too many", 0, kPatch + offsetof(defrec_patch, node) + 8,
             1},
            {"a patch whose position is infinite", 0, kPatch + offsetof(defrec_patch, position),
             infinity},
            {"a patch whose tangent is not a number", 0,
             kPatch + offsetof(defrec_patch, tangent_v) + 4, nan},
            {"a patch whose weight is not a number", 0, kPatch + offsetof(defrec_patch, weight),
             nan}};
    const uint32_t nodes = static_cast<const defrec_lm_params*>(job.params.get())->nodes;
    constexpr size_t kEdge = 4 * sizeof(defrec_edge);
    uint32_t a = 0;
    std::memcpy(&a, job.prepare[1].bytes.data() + kEdge, sizeof a);
    std::vector<Fault> faults = {
        {"a control point whose position is not a number", 0, 8, nan},
        {"an edge from a control point to itself", 1, kEdge + offsetof(defrec_edge, b), a},
        {"an edge to a control point too many", 1, kEdge + offsetof(defrec_edge, b), nodes},
        {"an edge without weight", 1, kEdge + offsetof(defrec_edge, weight), 0},
        {"an edge whose weight is not a number", 1, kEdge + offsetof(defrec_edge, weight), nan},
        {"a point whose normal is not a number", 2, kPoint + offsetof(defrec_surface_point, normal),
         nan},
        {"a landmark with control point -1", 3, kPoint + offsetof(defrec_surface_point, node),
         kMinusOne},
        {"a patch whose position is infinite", 4, kPatch + offsetof(defrec_patch, position),
         infinity}};
    for (const Fault& fault : point(2, nodes)) faults.push_back(fault);
    return faults;
}

std::vector<Buffer> upload(const Session& session, Queue& queue, const std::vector<Input>& inputs) {
    std::vector<Buffer> buffers;
    for (const Input& input : inputs) {
        buffers.push_back(input.given ? Buffer(session, input.bytes.size()) : Buffer());
        if (input.given) queue.write(buffers.back(), input.bytes);
    }
    return buffers;
}

void bad_template(CaseRun& run, uint32_t stage) {
    const Session& session = run.subject();
    const StageJob good = sample_job(stage);
    Queue queue(session);
    const std::vector<Buffer> right = upload(session, queue, good.prepare);
    Stage made(session, stage, good.params.get());
    for (const Fault& fault : faults_of(stage, good)) {
        std::vector<Input> inputs = good.prepare;
        std::memcpy(inputs[fault.buffer].bytes.data() + fault.offset, &fault.bits,
                    sizeof fault.bits);
        const std::vector<Buffer> wrong = upload(session, queue, inputs);
        std::vector<defrec_pbuffer*> pointers;
        for (const Buffer& buffer : wrong) pointers.push_back(buffer.get());
        require_refused(session, concat("prepare with ", fault.what),
                        session.stage_table(stage).prepare(made.get(), queue.get(), pointers.data(),
                                                           pointers.size()));
        queue.finish();
    }
    made.prepare(queue, right);
    queue.finish();
}

void no_allocation(CaseRun& run, uint32_t stage) {
    const Session& session = run.subject();
    const StageJob job = sample_job(stage);
    Queue queue(session);
    const std::vector<Buffer> prepared = upload(session, queue, job.prepare),
                              in = upload(session, queue, job.in);
    std::vector<Buffer> out;
    for (const Output& output : job.out) out.push_back(Buffer(session, output.size));
    Stage made(session, stage, job.params.get());
    if (!prepared.empty()) made.prepare(queue, prepared);
    queue.finish();
    const uint64_t before = session.host().allocations();
    for (int i = 0; i < 3; ++i) made.enqueue(queue, in, out);
    queue.finish();
    const uint64_t asked = session.host().allocations() - before;
    require(asked == 0, "enqueue of ", stage_name(stage), " asked the host for memory, ", asked,
            " times in three runs");
}

}  // namespace

void add_abi_template_cases(std::vector<Case>& cases) {
    for (const uint32_t stage : {DEFREC_STAGE_ALIGN, DEFREC_STAGE_LM, DEFREC_STAGE_WARP})
        add_abi_stage_case(cases, "bad_template",
                           "prepare refuses indices out of range and numbers that are not finite.",
                           bad_template, stage, stage + 1);
    add_abi_stage_case(cases, "no_allocation", "enqueue never asks for memory.", no_allocation);
}

}  // namespace defrec::conformance
