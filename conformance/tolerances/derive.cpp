// See derive.hpp.
#include "conformance/tolerances/derive.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <map>

#include "conformance/cases/stage/stage_case.hpp"

namespace defrec::conformance {
namespace {

// The largest of all cases, and where.
struct Largest {
    double maximum = 0, p99 = 0;
    std::string from;

    void add(const Distances& distances, const std::string& id) {
        if (distances.maximum() > maximum || from.empty()) from = id;
        maximum = std::max(maximum, distances.maximum());
        p99 = std::max(p99, distances.p99());
    }
};
struct Derived {
    Largest spread, backend;
};

// Zeroes stay: they are marks, such as weights of unused control points, or exact by their nature.
float jittered(float value, Random& random) {
    const uint32_t kind = random.below(3);
    if (kind == 0 || value == 0 || !std::isfinite(value)) return value;
    return std::nextafter(value, kind == 1 ? std::numeric_limits<float>::max()
                                           : std::numeric_limits<float>::lowest());
}

void jitter(Input& input, Random& random) {
    if (input.record == 0) return;
    for (size_t record = 0; record + input.record <= input.bytes.size(); record += input.record)
        for (const auto& [offset, count] : input.floats)
            for (uint32_t i = 0; i < count; ++i) {
                std::byte* at = input.bytes.data() + record + offset + 4 * i;
                float value;
                std::memcpy(&value, at, sizeof value);
                value = jittered(value, random);
                std::memcpy(at, &value, sizeof value);
            }
}

StageJob jittered(StageJob job, uint64_t seed) {
    Random random(seed);
    for (Input& input : job.prepare) jitter(input, random);
    for (Input& input : job.in) jitter(input, random);
    return job;
}

// What ransac only hands on is no result of it: the matches as they were, with the found weights.
Bytes with_weights_of(Bytes matches, const Bytes& found) {
    for (size_t i = offsetof(defrec_match, weight); i < matches.size(); i += sizeof(defrec_match))
        std::copy_n(found.begin() + std::ptrdiff_t(i), sizeof(float),
                    matches.begin() + std::ptrdiff_t(i));
    return matches;
}

void derive_from(const StageCase& one, Workbench& bench, bool measure_subject,
                 std::map<std::string, Derived>& all) {
    CaseRun run(concat("stage/", stage_name(one.stage), "/", one.name), bench,
                Tolerances::of_suite());
    const StageJob job = one.make(run, 0);
    const std::vector<Bytes> expected = run_plainly(bench.reference(), job);
    for (int k = 0; k < kJitters; ++k) {
        Spread spread;
        std::vector<Bytes> found = run_plainly(bench.reference(), jittered(job, uint64_t(k)));
        if (one.stage == DEFREC_STAGE_RANSAC) found[0] = with_weights_of(expected[0], found[0]);
        one.spread(job, expected, found, spread);
        for (const auto& [name, distances] : spread.all())
            all[name].spread.add(distances, run.id());
    }
    if (!measure_subject) return;
    Spread spread;
    one.spread(job, expected, run_plainly(bench.subject(), job), spread);
    for (const auto& [name, distances] : spread.all()) all[name].backend.add(distances, run.id());
}

void print(const std::string& name, const Derived& derived, bool with_backend) {
    const Tolerance& tolerance = Tolerances::of_suite().at(name);
    std::printf("%-19s spread %.2e, p99 %.2e (%s); 4 times %.2e, %.2e; allowed %.2e, %.2e",
                name.c_str(), derived.spread.maximum, derived.spread.p99,
                derived.spread.from.c_str(), kMargin * derived.spread.maximum,
                kMargin * derived.spread.p99, tolerance.maximum, tolerance.p99);
    if (with_backend)
        std::printf("; backend %.2e, %.2e (%s)", derived.backend.maximum, derived.backend.p99,
                    derived.backend.from.c_str());
    std::printf("\n");
}

}  // namespace

void print_derived_tolerances(const std::string& backend) {
    const Plugin reference(find_backend("reference"), ""),
        subject(find_backend(backend.empty() ? "reference" : backend), "");
    Workbench bench(subject, reference);
    std::map<std::string, Derived> all;
    for (const StageCase& one : stage_cases()) {
        if (one.spread == nullptr) continue;
        try {
            derive_from(one, bench, !backend.empty(), all);
        } catch (const CaseFailure& failure) {
            std::printf("%s/%s: a decision fell differently: %s\n", stage_name(one.stage),
                        one.name.c_str(), failure.what());
        }
    }
    for (const auto& [name, derived] : all) print(name, derived, !backend.empty());
}

}  // namespace defrec::conformance
