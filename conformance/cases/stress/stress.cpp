// See stress.hpp.
#include "conformance/cases/stress/stress.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "conformance/worker/failure.hpp"
#include "sdk/base/os/aligned_memory.hpp"
#include "sdk/contract/enumerations.hpp"

namespace defrec::conformance {

const RenderedSequence& stress_sequence() { return rendered_sequence({"heartbeat", 192, 160, 4}); }

TrackingDevice tracking_subject(CaseRun& run) {
    const defrec_device_info& device = run.subject().info();
    if ((device.stages & kEveryStage) != kEveryStage)
        skip_case("the device does not offer every stage, which tracking needs");
    return {run.subject_plugin().files().manifest, device.id};
}

void CountingAllocator::install(defrec_context_desc& desc) {
    desc.alloc = take;
    desc.free = give;
    desc.alloc_user = this;
}

void CountingAllocator::fail_at(uint64_t nth) { fail_at_ = nth == 0 ? 0 : taken_ + nth; }

void* CountingAllocator::take(void* user, size_t size, size_t alignment) {
    auto& self = *static_cast<CountingAllocator*>(user);
    if (++self.taken_ == self.fail_at_) return nullptr;
    const size_t boundary = std::max(alignment, sizeof(void*));
    void* memory = allocate_aligned(std::max<size_t>(size, 1), boundary);
    if (memory == nullptr) return nullptr;
    ++self.live_;
    // What a stage reads before it has written it is seen by this pattern rather than by luck.
    return std::memset(memory, 0xA5, size);
}

void CountingAllocator::give(void* user, void* memory) {
    if (memory == nullptr) return;
    --static_cast<CountingAllocator*>(user)->live_;
    free_aligned(memory);
}

defrec_context_desc stress_context_desc() {
    defrec_context_desc desc;
    DEFREC_INIT(&desc);
    desc.threads = 2;
    return desc;
}

RigHandle open_rig(defrec_context context, const RenderedSequence& sequence) {
    RigHandle rig;
    check_api("defrec_rig_create", defrec_rig_create(context, &sequence.rig, rig.out()));
    return rig;
}

void require_message(const char* call) {
    const std::string message = defrec_last_error();
    require(message.size() > 8 && message.find(' ') != std::string::npos, call, " failed with \"",
            message, "\", an error message expected");
}

std::vector<uint64_t> spread_over(uint64_t total, size_t maximum) {
    std::vector<uint64_t> chosen;
    if (total == 0) return chosen;
    for (size_t i = 0; i < maximum; ++i)
        chosen.push_back(1 + (total - 1) * i / std::max<size_t>(maximum - 1, 1));
    chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
    return chosen;
}

const Track& undisturbed(CaseRun& run) {
    return kept_track(tracking_subject(run), stress_sequence());
}

void require_same(CaseRun& run, const Track& found, const std::string& when) {
    const Track& expected = undisturbed(run);
    require(found.frames.size() == expected.frames.size(), when, " ", found.frames.size(),
            " frames were tracked, ", expected.frames.size(), " expected");
    for (size_t i = 0; i < expected.frames.size(); ++i) {
        const TrackedFrame &a = expected.frames[i], &b = found.frames[i];
        require(a.state == b.state && a.vertices.size() == b.vertices.size(), when, " frame ", i,
                " has state ", b.state, ", ", a.state, " expected");
        if (!run.subject().claims_repeatable()) continue;
        require(
            a.vertices == b.vertices && a.vertex_status == b.vertex_status && a.points == b.points,
            when, " frame ", i,
            " is not, bit for bit, what it is when tracked alone, though the device claims to be "
            "repeatable");
    }
}

void add_stress_case(std::vector<Case>& cases, const char* name, StressList list, const char* title,
                     void (*body)(CaseRun&)) {
    cases.push_back(
        {std::string("stress/") + name, "stress", "", title, list == kShort, true, body});
}

void add_stress_cases(std::vector<Case>& cases) {
    add_memory_cases(cases);
    add_concurrency_cases(cases);
    add_device_failure_cases(cases);
}

}  // namespace defrec::conformance
