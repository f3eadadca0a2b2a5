// See derive.hpp.
#include "conformance/tolerances/derive.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <map>

#include "conformance/cases/stage/stage_case.hpp"
#include "conformance/examine.hpp"

namespace defrec::conformance {
namespace {

struct Derived {
    double maximum = 0, p99 = 0;
    std::string from;  // the case with the largest
};

// Zeroes stay: they are marks, such as weights of unused control points, or exact by their nature.
float jittered(float value, Random& random) {
    const uint32_t kind = random.below(3);
    if (kind == 0 || value == 0 || !std::isfinite(value)) return value;
    return std::nextafter(value, kind == 1 ? std::numeric_limits<float>::max() : std::numeric_limits<float>::lowest());
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
        std::copy_n(found.begin() + std::ptrdiff_t(i), sizeof(float), matches.begin() + std::ptrdiff_t(i));
    return matches;
}

void derive_from(const StageCase& one, Workbench& bench, std::map<std::string, Derived>& all) {
    CaseRun run(concat("stage/", stage_name(one.stage), "/", one.name), bench, Tolerances::of_suite());
    const StageJob job = one.make(run, 0);
    const std::vector<Bytes> expected = run_plainly(bench.reference(), job);
    for (int k = 0; k < kJitters; ++k) {
        Spread spread;
        std::vector<Bytes> found = run_plainly(bench.reference(), jittered(job, uint64_t(k)));
        if (one.stage == DEFREC_STAGE_RANSAC) found[0] = with_weights_of(expected[0], found[0]);
        one.spread(job, expected, found, spread);
        for (const auto& [name, distances] : spread.all()) {
            Derived& derived = all[name];
            if (distances.maximum() > derived.maximum || derived.from.empty()) {
                derived.maximum = distances.maximum();
                derived.from = run.id();
            }
            derived.p99 = std::max(derived.p99, distances.p99());
        }
    }
}

}  // namespace

void print_derived_tolerances() {
    std::map<std::string, Derived> all;
    try {
        const Plugin reference(find_backend("reference"), "");
        Workbench bench(reference, reference);
        for (const StageCase& one : stage_cases()) {
            if (one.spread == nullptr) continue;
            try {
                derive_from(one, bench, all);
            } catch (const CaseFailure& failure) {
                std::printf("# %s/%s: a decision fell differently: %s\n", stage_name(one.stage), one.name.c_str(), failure.what());
            }
        }
    } catch (const Error& error) {
        throw Unavailable(error.what());
    }
    for (const auto& [name, derived] : all)
        std::printf("%-22s maximum %.3g p99 %.3g   # spread %.3g, %.3g; largest in %s\n", name.c_str(), kMargin * derived.maximum,
                    kMargin * derived.p99, derived.maximum, derived.p99, derived.from.c_str());
}

}  // namespace defrec::conformance
