// The CPU backend as backends/agreement tests it.
#pragma once
#include "backends/cpu/stages.hpp"

namespace defrec::under_test {

using namespace cpu;
constexpr const char* kBackend = "cpu";
inline bool available() { return true; }

}  // namespace defrec::under_test
