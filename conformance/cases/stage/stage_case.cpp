// See stage_case.hpp.
#include "conformance/cases/stage/stage_case.hpp"

#include <utility>

namespace defrec::conformance {
namespace {

constexpr uint64_t kRemembered = uint64_t{16}
                                 << 20;  // bytes of outputs that are kept for the next repetition

// Bytes that are no result hold what the suite put there.
bool same_results(const Expected& expected, const Found& found) {
    for (size_t i = 0; i < expected.written.size(); ++i)
        for (size_t byte = 0; byte < expected.written[i].size(); ++byte)
            if (expected.written[i][byte] && found.first[i][byte] != found.second[i][byte])
                return false;
    return true;
}

void examine(CaseRun& run, const StageCase& one) {
    run.subject().stage_table(one.stage);
    const StageJob job = one.make(run, 0), other = one.make(run, 1);
    uint64_t bytes = 0;
    for (const Output& output : job.out) bytes += output.size;
    const auto expect = [&] { return run_reference(run.reference(), job); };
    Expected fresh;
    const bool remember = bytes <= kRemembered;
    if (!remember) fresh = expect();
    const Expected& expected =
        remember ? run.bench().remembered<Expected>(run.id(), expect) : fresh;
    if (one.expects) one.expects(expected);

    const Found found = run_strictly(run.subject(), job, other, expected);
    for (const Bytes& output : found.first) run.digest(output);
    one.compare(run, job, expected, found.first);
    if (same_results(expected, found)) return;
    if (run.subject().claims_repeatable())
        run.note_failure(
            "the same input gave other bits after another frame, with other bytes in the outputs "
            "beforehand");
    one.compare(run, job, expected, found.second);
}

}  // namespace

std::vector<StageCase> stage_cases() {
    std::vector<StageCase> cases;
#define DEFREC_ADD_CASES(name, NAME) add_##name##_cases(cases);
    DEFREC_STAGES(DEFREC_ADD_CASES, DEFREC_NOTHING)
#undef DEFREC_ADD_CASES
    return cases;
}

void add_stage_cases(std::vector<Case>& cases) {
    add_ransac_in_place_case(cases);
    for (StageCase& one : stage_cases()) {
        const std::string stage = stage_name(one.stage);
        Case entry{concat("stage/", stage, "/", one.name),
                   "stage",
                   stage,
                   one.title,
                   one.smoke,
                   one.slow,
                   {},
                   one.since};
        entry.body = [one = std::move(one)](CaseRun& run) { examine(run, one); };
        cases.push_back(std::move(entry));
    }
}

StageCase float_case(uint32_t stage, const char* name, const char* title,
                     std::function<StageJob(CaseRun&, uint32_t)> make, SpreadOf spread, bool smoke,
                     bool slow) {
    const auto compare = [spread](CaseRun& run, const StageJob& job, const Expected& expected,
                                  const std::vector<Bytes>& found) {
        Spread distances;
        spread(job, expected.outputs, found, distances);
        distances.measure(run);
    };
    return {stage, name, title, std::move(make), compare, smoke, slow, {}, spread, 1};
}

void compare_all_exactly(CaseRun& run, const StageJob& job, const Expected& expected,
                         const std::vector<Bytes>& found) {
    for (size_t i = 0; i < job.out.size(); ++i)
        if (job.out[i].given) compare_exactly(run, job, i, expected, found);
}

}  // namespace defrec::conformance
