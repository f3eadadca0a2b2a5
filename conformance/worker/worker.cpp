// See worker.hpp.
#include "conformance/worker/worker.hpp"

#include <cfenv>
#include <chrono>
#include <exception>
#include <optional>

namespace defrec::conformance {
namespace {

DeviceDescription describe(const Session& session) {
    const auto text = [](const char* given) { return std::string(given == nullptr ? "" : given); };
    const defrec_device_info& info = session.info();
    return {text(session.table().vendor),
            text(info.id),
            text(info.name),
            text(info.driver),
            info.kind,
            info.features,
            info.stages};
}

void note_host_misuse(RunResult& result, const std::string& misuse) {
    if (misuse.empty() || result.verdict == Verdict::failed) return;
    result.verdict = Verdict::failed;
    result.reason = misuse;
}

// The plugin is shut down, and what it had of the host's must be back.
RunResult end_life(Workbench& bench) {
    RunResult result;
    try {
        bench.close_subject();
    } catch (const std::exception& error) {
        result.verdict = Verdict::failed;
        result.reason = error.what();
    }
    return result;
}

}  // namespace

RunResult run_case(const Case& one, Workbench& bench, const Tolerances& tolerances) {
    std::fesetenv(FE_DFL_ENV);  // whatever the plugin left in the case before
    const auto start = std::chrono::steady_clock::now();
    CaseRun run(one.id, bench, tolerances);
    RunResult result;
    try {
        one.body(run);
    } catch (const CaseSkipped& skipped) {
        result.verdict = Verdict::skipped;
        result.reason = skipped.what();
    } catch (const std::bad_alloc&) {
        result.verdict = Verdict::failed;
        result.reason = "out of memory";
    } catch (const CaseFailure& failure) {
        result.verdict = Verdict::failed;
        result.reason = failure.what();
    } catch (const Error& error) {
        result.verdict = Verdict::failed;
        result.reason = error.what();
    } catch (const std::exception& error) {
        result.verdict = Verdict::failed;
        result.reason = concat("an exception came out of the plugin: ", error.what());
    } catch (...) {
        result.verdict = Verdict::failed;
        result.reason = "an exception of unknown type came out of the plugin";
    }
    if (result.verdict == Verdict::passed && !run.failure.empty()) {
        result.verdict = Verdict::failed;
        result.reason = run.failure;
    }
    for (const Metric& metric : run.metrics) {
        if (result.verdict != Verdict::passed || metric.passed()) continue;
        result.verdict = Verdict::failed;
        result.reason =
            concat(metric.name, ": maximum ", metric.maximum, " ", metric.unit, " (limit ",
                   metric.limit_maximum, "), p99 ", metric.p99, " (limit ", metric.limit_p99, ")");
    }
    note_host_misuse(result, bench.subject_misuse());
    note_host_misuse(result, bench.subject_plugin().take_misuse());
    if (result.verdict == Verdict::failed) {
        bench.forget_subject();
        bench.subject_plugin().take_misuse();  // of this case, which has failed already
    }
    result.metrics = std::move(run.metrics);
    result.pictures = std::move(run.pictures);
    result.digest = run.digest_value;
    result.seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return result;
}

void run_worker(const Examination& who, std::span<const Case> cases, std::span<const Step> steps,
                const MessageSender& sender) {
    Message message;
    const auto send = [&](MessageKind kind) {
        message.kind = kind;
        sender.send(message);
        message = {};
    };
    std::optional<Plugin> subject, reference;
    std::optional<Workbench> bench;
    try {
        subject.emplace(who.subject, who.device_id);
        reference.emplace(who.reference, "");
        bench.emplace(*subject, *reference);
        message.device = describe(bench->subject());
    } catch (const std::exception& error) {
        message.text = error.what();
        return send(MessageKind::refused);
    } catch (...) {
        message.text = "the plugin threw an exception while it was loaded";
        return send(MessageKind::refused);
    }
    send(MessageKind::ready);
    for (size_t i = 0; i <= steps.size(); ++i) {
        message.step = i;
        send(MessageKind::began);
        message.step = i;
        message.result = i < steps.size()
                             ? run_case(cases[steps[i].one], *bench, Tolerances::of_suite())
                             : end_life(*bench);
        send(MessageKind::ended);
    }
}

}  // namespace defrec::conformance
