// The abi tier: what docs/plugins.md and include/defrec_plugin.h promise of any plugin. One file for each part of the tables.
#pragma once
#include <utility>
#include <vector>

#include "conformance/case.hpp"

namespace defrec::conformance {

inline void add_abi_case(std::vector<Case>& cases, const char* name, const char* title, std::function<void(CaseRun&)> body) {
    cases.push_back({std::string("abi/") + name, "abi", "", title, true, false, std::move(body)});
}

void add_abi_entry_cases(std::vector<Case>& cases);

}  // namespace defrec::conformance
