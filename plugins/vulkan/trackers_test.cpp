// Many trackers on one device, in several contexts and threads: all of them share what the driver
// has only a few of.
#include <doctest/doctest.h>

#include "conformance/cases/stress/stress.hpp"
#include "conformance/worker/plugin.hpp"
#include "conformance/worker/threads.hpp"

using namespace defrec;
using namespace defrec::conformance;

namespace {

constexpr size_t kContexts = 4, kTrackers = 32;

const RenderedSequence& film() { return rendered_sequence({"heartbeat", 128, 96, 2}); }

// Id of the first device that offers stages; "" where there is none.
std::string first_device(defrec_context context) {
    for (size_t i = 0; i < defrec_device_count(context); ++i) {
        defrec_device_info info;
        DEFREC_INIT(&info);
        check_api("defrec_device_get", defrec_device_get(context, i, &info));
        if (info.stages != 0) return info.id;
    }
    return "";
}

}  // namespace

TEST_CASE("32 trackers that exist at once in 4 contexts give the bits of one alone") {
    const std::string manifest = find_backend("vulkan").manifest;
    std::vector<ContextHandle> contexts;
    for (size_t i = 0; i < kContexts; ++i) contexts.push_back(open_context(manifest));
    const std::string device = first_device(contexts[0].get());
    if (device.empty()) {
        MESSAGE("skipped: no Vulkan device");
        return;
    }
    const Track expected = track_in(contexts[0].get(), device, film());
    REQUIRE(expected.frames.back().has_surface());

    std::vector<RigHandle> rigs;
    for (const ContextHandle& context : contexts) rigs.push_back(open_rig(context.get(), film()));
    std::vector<TrackerHandle> trackers(kTrackers);
    on_threads(kTrackers, [&](size_t i) {
        const size_t of = i % kContexts;
        trackers[i] = open_tracker(contexts[of].get(), rigs[of].get(), device);
    });
    std::vector<std::vector<TrackedFrame>> found(kTrackers);
    on_threads(kTrackers, [&](size_t i) {
        for (size_t frame = 0; frame < film().frames.size(); ++frame) {
            const JobHandle job = submit(trackers[i].get(), film(), frame);
            check_api("defrec_job_wait", defrec_job_wait(job.get(), UINT64_MAX));
            found[i].push_back(result_of(job.get(), {}));
        }
    });
    for (size_t i = 0; i < kTrackers; ++i) {
        CAPTURE(i);
        for (size_t frame = 0; frame < film().frames.size(); ++frame) {
            CHECK(found[i][frame].state == expected.frames[frame].state);
            CHECK((found[i][frame].vertices == expected.frames[frame].vertices));
        }
    }
}
