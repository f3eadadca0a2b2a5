// The abi tier: what docs/backends/plugins.md and include/defrec_plugin.h promise of any plugin.
// One file for each part of the tables.
#pragma once
#include <functional>
#include <utility>
#include <vector>

#include "conformance/worker/case.hpp"
#include "conformance/worker/stage_job.hpp"

namespace defrec::conformance {

inline void add_abi_case(std::vector<Case>& cases, const char* name, const char* title,
                         std::function<void(CaseRun&)> body) {
    cases.push_back({std::string("abi/") + name, "abi", "", title, true, false, std::move(body)});
}
// One for each stage from `first` on: abi/name/stage.
void add_abi_stage_case(std::vector<Case>& cases, const char* name, const char* title,
                        const std::function<void(CaseRun&, uint32_t stage)>& body,
                        uint32_t first = 0, uint32_t end = DEFREC_STAGE_COUNT_V1);

// A refused call: the status is negative, and there is an error message that says why.
void require_refused(const Instance& instance, const std::string& call, defrec_status status);
void require_refused(const Session& session, const std::string& call, defrec_status status);

Bytes pattern_bytes(size_t size, uint64_t seed);

void add_abi_entry_cases(std::vector<Case>& cases);
void add_abi_device_cases(std::vector<Case>& cases);
void add_abi_buffer_cases(std::vector<Case>& cases);
void add_abi_memory_cases(std::vector<Case>& cases);
void add_abi_queue_cases(std::vector<Case>& cases);
void add_abi_stage_cases(std::vector<Case>& cases);
void add_abi_template_cases(std::vector<Case>& cases);
void add_abi_thread_cases(std::vector<Case>& cases);
void add_abi_life_cases(std::vector<Case>& cases);

}  // namespace defrec::conformance
