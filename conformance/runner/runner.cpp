// See runner.hpp.
#include "conformance/runner/runner.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace defrec::conformance {
namespace {

using Clock = std::chrono::steady_clock;
constexpr uint32_t kMaxHangs =
    5;  // after which a plugin is given up: each takes its whole time limit

double worse(double a, double b) {
    return std::isnan(a) || std::isnan(b) ? std::nan("") : std::max(a, b);
}

void merge_metric(std::vector<Metric>& metrics, const Metric& metric) {
    const auto known = std::find_if(metrics.begin(), metrics.end(),
                                    [&](const Metric& m) { return m.name == metric.name; });
    if (known == metrics.end()) return metrics.push_back(metric);
    known->maximum = worse(known->maximum, metric.maximum);
    known->p99 = worse(known->p99, metric.p99);
    known->samples = std::max(known->samples, metric.samples);
}

RunResult failure(std::string reason) {
    RunResult result;
    result.verdict = Verdict::failed;
    result.reason = std::move(reason);
    return result;
}

// The results of all steps, filled by one worker after the other.
class Run {
  public:
    Run(const Examination& who, std::span<const Case> cases, const RunSettings& settings)
        : who_(who),
          cases_(cases),
          settings_(settings),
          results_(cases.size()),
          total_(cases.size() * settings.repetitions) {
        left_ = shuffled_steps(cases.size(), settings.repetitions, settings.seed);
    }

    RunOutcome take() {
        RunOutcome outcome;
        while (!left_.empty() || end_.empty()) {
            outcome.refusal = run_some();
            if (!outcome.refusal.empty()) return outcome;
        }
        outcome.device = device_;
        const bool repeatable = (device_.features & DEFREC_FEATURE_REPEATABLE) != 0;
        for (size_t i = 0; i < cases_.size(); ++i)
            outcome.cases.push_back(merge(cases_[i], results_[i], repeatable));
        outcome.cases.push_back(merge(end_of_process_case(), end_, false));
        return outcome;
    }

  private:
    // One worker, until it ends or is ended. The reason of a refusal, else empty.
    std::string run_some() {
        const std::vector<Step> steps = left_;
        ChildProcess child(
            [&](const MessageSender& sender) { run_worker(who_, cases_, steps, sender); },
            settings_.in_process ? Isolation::none : Isolation::process);
        Message message;
        auto event = child.receive(message, in(10 * settings_.time_limit));
        if (event == ChildProcess::Event::message && message.kind == MessageKind::refused)
            return message.text;
        if (event != ChildProcess::Event::message)
            return refusal_or_loss(concat("the plugin ", how_ended(child, event),
                                          " while it was loaded and its device opened"));
        device_ = message.device;
        size_t running = steps.size();
        bool in_step = false, at_end = false;
        while ((event = child.receive(message, deadline(steps, running, in_step))) ==
               ChildProcess::Event::message) {
            running = message.step;
            in_step = message.kind == MessageKind::began;
            if (in_step)
                tell(steps, running);
            else
                keep(steps, running, std::move(message.result));
            at_end = running == steps.size();
        }
        const std::string how = how_ended(child, event);
        if (!in_step && at_end && how.empty()) return "";
        const std::string reason = concat("the plugin ", how.empty() ? "ended the process" : how);
        if (at_end)
            end_ = {failure(reason + " at the end")};
        else if (in_step)
            lose(steps, running, reason);
        else
            return refusal_or_loss(reason + " between two cases");
        if (event == ChildProcess::Event::timed_out && ++hung_ == kMaxHangs)
            return refusal_or_loss(
                concat("not run: the plugin did not end in ", kMaxHangs, " other cases"));
        return "";
    }

    Clock::time_point deadline(const std::vector<Step>& steps, size_t running, bool in_step) const {
        const bool slow = in_step && running < steps.size() && cases_[steps[running].one].slow;
        return in((slow ? 10 : 1) * settings_.time_limit);
    }
    Clock::time_point in(std::chrono::seconds time) const {
        return settings_.in_process ? Clock::time_point::max() : Clock::now() + time;
    }

    static std::string how_ended(ChildProcess& child, ChildProcess::Event event) {
        const auto now = Clock::now();
        if (event == ChildProcess::Event::timed_out) return child.reap(now);
        return child.reap(now + std::chrono::seconds(10));
    }

    // A plugin that once could be loaded and now cannot is a failure of all that is left.
    std::string refusal_or_loss(const std::string& reason) {
        if (device_.id.empty()) return reason;
        for (const Step& step : left_) results_[step.one].push_back(failure(reason));
        left_.clear();
        if (end_.empty()) end_ = {failure(reason)};
        return "";
    }

    void tell(const std::vector<Step>& steps, size_t running) const {
        if (settings_.progress && running < steps.size())
            settings_.progress(total_ - left_.size(), total_, cases_[steps[running].one].id);
    }

    void keep(const std::vector<Step>& steps, size_t running, RunResult result) {
        if (running == steps.size()) {
            if (end_.empty() || end_[0].verdict == Verdict::passed) end_ = {std::move(result)};
            return;
        }
        results_[steps[running].one].push_back(std::move(result));
        left_.erase(left_.begin());
    }

    // The case that was running is not tried again.
    void lose(const std::vector<Step>& steps, size_t running, const std::string& reason) {
        const uint32_t lost = steps[running].one;
        results_[lost].push_back(failure(reason));
        std::erase_if(left_, [&](const Step& step) { return step.one == lost; });
    }

    const Examination& who_;
    std::span<const Case> cases_;
    const RunSettings& settings_;
    DeviceDescription device_;
    std::vector<std::vector<RunResult>> results_;  // of each case
    std::vector<RunResult> end_;
    std::vector<Step> left_;
    size_t total_;
    uint32_t hung_ = 0;
};

}  // namespace

Case end_of_process_case() {
    return {"abi/end_of_process",
            "abi",
            "",
            "The plugin ends well after all other cases, and gives the host's memory back.",
            true,
            false,
            {}};
}

std::vector<Step> shuffled_steps(size_t cases, uint32_t repetitions, uint64_t seed) {
    std::vector<Step> steps;
    for (uint32_t repetition = 0; repetition < repetitions; ++repetition)
        for (size_t one = 0; one < cases; ++one) steps.push_back({uint32_t(one), repetition});
    Random random(seed);
    for (size_t i = steps.size(); i > 1; --i)
        std::swap(steps[i - 1], steps[random.below(uint32_t(i))]);
    return steps;
}

CaseRecord merge(const Case& one, std::span<const RunResult> results, bool repeatable) {
    CaseRecord record{one.id,
                      one.tier,
                      one.stage,
                      one.title,
                      Verdict::skipped,
                      "",
                      {},
                      {},
                      uint32_t(results.size()),
                      0};
    bool same = true;
    for (const RunResult& result : results) {
        record.seconds += result.seconds;
        for (const Metric& metric : result.metrics) merge_metric(record.metrics, metric);
        same = same && result.digest == results[0].digest;
        const bool first = &result == &results[0];
        if (result.verdict == Verdict::failed && record.verdict != Verdict::failed) {
            record.verdict = Verdict::failed;
            record.reason = result.reason;
            record.pictures = result.pictures;
        } else if (first) {
            record.verdict = result.verdict;
            record.reason = result.reason;
        } else if (result.verdict != record.verdict && record.verdict != Verdict::failed) {
            record.verdict = Verdict::failed;
            record.reason = "skipped in one repetition and run in another";
        }
    }
    if (record.verdict == Verdict::passed && repeatable && !same) {
        record.verdict = Verdict::failed;
        record.reason =
            "repetitions gave different bits, though the device claims to be repeatable";
    }
    return record;
}

RunOutcome run_cases(const Examination& who, std::span<const Case> cases,
                     const RunSettings& settings) {
    return Run(who, cases, settings).take();
}

}  // namespace defrec::conformance
