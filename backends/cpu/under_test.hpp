// The CPU backend as backends/agreement tests it.
#pragma once
#include <doctest/doctest.h>
#include <hwy/highway.h>

#include <string>

#include "backends/cpu/stages.hpp"

namespace defrec::under_test {

using namespace cpu;
constexpr const char* kBackend = "cpu";
constexpr bool kReadsCounts = true;  // numbers in buffers are known when a run begins
inline bool available() { return true; }

// Calls check() for everything that the backend's code may run on: every instruction set of this
// processor.
template <class Check>
void on_every_target(Check&& check) {
    for (const int64_t target : {HWY_SSE4, HWY_AVX2, HWY_AVX3, HWY_AVX3_DL}) {
        if ((hwy::SupportedTargets() & target) == 0) continue;
        // Few files are compiled for the last one.
        hwy::SetSupportedTargetsForTest(target == HWY_AVX3_DL ? target | HWY_AVX3 : target);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
        CAPTURE(std::string(hwy::TargetName(target)));
        check();
        hwy::SetSupportedTargetsForTest(0);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    }
}

}  // namespace defrec::under_test
