// See case.hpp.
#include "conformance/worker/case.hpp"

#include <algorithm>

namespace defrec::conformance {

void Workbench::close_subject() {
    if (sessions_[0] == nullptr) return;
    const std::shared_ptr<Host> host = sessions_[0]->share_host();
    sessions_[0].reset();
    require(host->misuse().empty(), host->misuse());
    require(host->live_blocks() == 0, host->live_blocks(), " blocks of host memory (",
            host->live_bytes(), " bytes) were not given back before the end of shutdown");
}

void CaseRun::digest(std::span<const std::byte> bytes) {
    digest_value = fnv1a(digest_value, bytes.data(), bytes.size());
}

std::vector<Case> all_cases() {
    std::vector<Case> cases;
    add_abi_cases(cases);
    add_stage_cases(cases);
    add_sequence_cases(cases);
    add_stress_cases(cases);
    std::sort(cases.begin(), cases.end(), [](const Case& a, const Case& b) { return a.id < b.id; });
    return cases;
}

}  // namespace defrec::conformance
