// What a plugin leaves behind: threads, memory, the process's environment; and that nothing is
// thrown at its host.
#include <cfenv>
#include <clocale>
#include <cstring>
#include <filesystem>
#if defined(__SSE__)
#include <xmmintrin.h>
#endif

#include "conformance/cases/abi/abi.hpp"
#include "conformance/scenes/sample_job.hpp"
#include "conformance/worker/system.hpp"
#include "conformance/worker/threads.hpp"
#include "sdk/base/os/kept_floating_point.hpp"

namespace defrec::conformance {
namespace {

void use_every_stage(Session& session) {
    for (uint32_t stage = 0; stage < DEFREC_STAGE_COUNT_V1; ++stage)
        if (session.offers(stage)) run_plainly(session, sample_job(stage));
}

// A driver may keep threads of its own for as long as the process lives, which appear with its
// first use; what grows with each life of an instance is the plugin's.
void no_thread_left(CaseRun& run) {
    run.reference();
    const auto live = [&] {
        Session session(run.subject_plugin());
        use_every_stage(session);
    };
    live();
    const size_t before = thread_count();
    live();
    live();
    const size_t left = threads_beyond(before);
    require(left == 0, left, " threads are left over from two lives of the plugin");
}

void no_memory_left(CaseRun& run) {
    std::shared_ptr<Host> host;
    {
        Session session(run.subject_plugin());
        host = session.share_host();
        use_every_stage(session);
    }
    require(host->live_blocks() == 0, host->live_blocks(), " blocks of host memory (",
            host->live_bytes(), " bytes) were not given back before the end of shutdown");
    require(host->misuse().empty(), host->misuse());
}

// Memory that belongs to stages and buffers goes with them, not only at the end.
void no_memory_kept(CaseRun& run) {
    Session session(run.subject_plugin());
    use_every_stage(session);
    use_every_stage(session);
    const uint64_t before = session.host().live_bytes();
    for (int i = 0; i < 3; ++i) use_every_stage(session);
    const uint64_t after = session.host().live_bytes();
    require(after <= before, "host memory in use grew from ", before, " to ", after,
            " bytes by stages and buffers that were destroyed");
}

struct Environment {
    Environment() {
        rounding = fegetround();
#if defined(__SSE__)
        control = _mm_getcsr() & ~0x3fu;  // without the sticky flags
#endif
#if defined(__GLIBC__)
        exceptions = fegetexcept();
#endif
        locale = setlocale(LC_ALL, nullptr);
        std::error_code unknown;
        folder = std::filesystem::current_path(unknown).string();
    }
    int rounding, exceptions = 0;
    uint32_t control = 0;
    SignalState signals;
    std::string locale, folder;
};

void environment(CaseRun& run) {
    std::fesetenv(FE_DFL_ENV);  // whatever the cases before have let happen
    const Environment before;
    // The host sets it back behind each call.
    const uint64_t changes = KeptFloatingPoint::changes();
    {
        Session session(run.subject_plugin());
        use_every_stage(session);
    }
    const Environment after;
    std::fesetenv(FE_DFL_ENV);  // or the cases that follow would suffer
    require(before.rounding == after.rounding && before.control == after.control &&
                before.exceptions == after.exceptions && KeptFloatingPoint::changes() == changes,
            "the plugin changed the floating point mode of its caller");
    const std::string changed = before.signals.difference(after.signals);
    require(changed.empty(), "the plugin changed ", changed);
    require(before.locale == after.locale, "the plugin changed the locale to ", after.locale);
    require(before.folder == after.folder, "the plugin changed the working folder");
}

// Runs, refusals, and a host without memory: whatever goes wrong inside becomes a status.
void no_exception(CaseRun& run) {
    Session session(run.subject_plugin());
    const auto guarded = [&](const std::string& call, const auto& body) {
        try {
            body();
        } catch (
            const CaseFailure&) {  // ours: a status that was no success, which other cases judge
        } catch (const std::exception& error) {
            fail_case(call, " threw an exception: ", error.what());
        } catch (...) {
            fail_case(call, " threw an exception of unknown type");
        }
    };
    for (uint32_t stage = 0; stage < DEFREC_STAGE_COUNT_V1; ++stage) {
        if (!session.offers(stage)) continue;
        const StageJob job = sample_job(stage);
        const std::string name = stage_name(stage);
        guarded("a run of " + name, [&] { run_plainly(session, job); });
        guarded("enqueue of " + name + " without buffers", [&] {
            Queue queue(session);
            Stage made(session, stage, job.params.get());
            made.enqueue(queue, {}, {});
        });
        session.host().fail_allocation(1, true);
        guarded("a run of " + name + " without memory", [&] { run_plainly(session, job); });
        session.host().fail_allocation(0);
    }
}

}  // namespace

void add_abi_life_cases(std::vector<Case>& cases) {
    add_abi_case(cases, "no_thread_left", "No thread is left when shutdown has returned.",
                 no_thread_left);
    add_abi_case(cases, "no_memory_left", "No host memory is left when shutdown has returned.",
                 no_memory_left);
    add_abi_case(cases, "no_memory_kept", "Host memory goes with what was made with it.",
                 no_memory_kept);
    add_abi_case(cases, "environment",
                 "Floating point mode, signals, locale and working folder stay as they were.",
                 environment);
    add_abi_case(cases, "no_exception", "No exception crosses the border.", no_exception);
}

}  // namespace defrec::conformance
