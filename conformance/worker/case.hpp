// What a case of the suite is, what its body gets, and what it gives back.
#pragma once
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "conformance/worker/failure.hpp"
#include "conformance/worker/plugin.hpp"
#include "conformance/worker/random.hpp"
#include "conformance/worker/record.hpp"
#include "conformance/worker/tolerances.hpp"
#include "sdk/base/util/fnv1a.hpp"

namespace defrec::conformance {

// The plugins of one worker process, and sessions that cases share so as not to open a device each
// time.
class Workbench {
  public:
    Workbench(const Plugin& subject, const Plugin& reference) : plugins_{&subject, &reference} {}
    const Plugin& subject_plugin() const { return *plugins_[0]; }
    const Plugin& reference_plugin() const { return *plugins_[1]; }
    Session& subject() { return session(0); }
    Session& reference() { return session(1); }
    // After a failure nothing of the session is to be relied on.
    void forget_subject() { sessions_[0].reset(); }
    // What the subject did wrong with its host so far, empty if nothing or if it is not open.
    std::string subject_misuse() const {
        return sessions_[0] == nullptr ? "" : sessions_[0]->host().misuse();
    }
    // Shuts the subject down; throws CaseFailure if it did something wrong with its host on the
    // way, or kept memory.
    void close_subject();

    // What cases keep for their next repetition in this process, by a name of their own; made where
    // it is absent.
    template <class T, class Make>
    const T& remembered(const std::string& name, Make make) {
        std::shared_ptr<void>& kept = memory_[name];
        if (kept == nullptr) kept = std::make_shared<T>(make());
        return *static_cast<const T*>(kept.get());
    }

  private:
    Session& session(size_t which) {
        if (sessions_[which] == nullptr)
            sessions_[which] = std::make_unique<Session>(*plugins_[which]);
        return *sessions_[which];
    }
    const Plugin* plugins_[2];
    std::unique_ptr<Session> sessions_[2];
    std::map<std::string, std::shared_ptr<void>> memory_;
};

// One repetition of one case.
class CaseRun {
  public:
    CaseRun(std::string id, Workbench& bench, const Tolerances& tolerances)
        : id_(std::move(id)), bench_(bench), tolerances_(tolerances) {}

    // The device under test and the reference, open; other cases use the same sessions. A case that
    // ends, counts or breaks something opens sessions of its own on the plugins.
    Session& subject() { return bench_.subject(); }
    Session& reference() { return bench_.reference(); }
    const Plugin& subject_plugin() const { return bench_.subject_plugin(); }
    const Plugin& reference_plugin() const { return bench_.reference_plugin(); }
    const Tolerances& tolerances() const { return tolerances_; }
    Workbench& bench() { return bench_; }
    const std::string& id() const { return id_; }

    // Depends on the case alone: every repetition gets the same numbers.
    Random random() const { return Random(id_); }

    // A figure beyond its limit fails the case; all of a case's figures are recorded either way.
    void measure(Metric metric) { metrics.push_back(std::move(metric)); }
    // Fails the case, but not before its body has ended: what else there is to measure is measured.
    // The first reason stays.
    void note_failure(const std::string& reason) {
        if (failure.empty()) failure = reason;
    }
    void show(Picture picture) { pictures.push_back(std::move(picture)); }
    // Adds what a device that claims DEFREC_FEATURE_REPEATABLE must give again, to the bit, in
    // every repetition.
    void digest(std::span<const std::byte> bytes);

    std::vector<Metric> metrics;
    std::vector<Picture> pictures;
    std::string failure;
    uint64_t digest_value = kFnvBasis;

  private:
    std::string id_;
    Workbench& bench_;
    const Tolerances& tolerances_;
};

struct Case {
    std::string id;     // tier/stage/name or tier/name; never changes its meaning
    std::string tier;   // "abi", "stage", "sequence", "stress"
    std::string stage;  // empty where the case is of no stage
    std::string title;  // one sentence: what holds if it passes
    bool smoke =
        false;  // in the short list, which a software GPU on two cores passes within minutes
    bool slow =
        false;  // may take up to ten times as long as other cases before it counts as hanging
    std::function<void(CaseRun&)> body;
    uint32_t since = 1;  // the suite version that brought it
};

// Every case of the suite, in the order of their ids.
std::vector<Case> all_cases();

// One for each folder in cases/.
void add_abi_cases(std::vector<Case>& cases);
void add_stage_cases(std::vector<Case>& cases);
void add_sequence_cases(std::vector<Case>& cases);
void add_stress_cases(std::vector<Case>& cases);

}  // namespace defrec::conformance
