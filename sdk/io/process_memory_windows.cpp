// See process_memory.hpp.
#include "sdk/base/os/windows_api.hpp"
#include "sdk/io/process_memory.hpp"

namespace defrec::cli {
namespace {

PROCESS_MEMORY_COUNTERS counters() {
    PROCESS_MEMORY_COUNTERS counters{};
    counters.cb = sizeof counters;
    if (::K32GetProcessMemoryInfo(::GetCurrentProcess(), &counters, sizeof counters) == 0)
        return {};
    return counters;
}

}  // namespace

double resident_megabytes() { return static_cast<double>(counters().WorkingSetSize) / 1e6; }

double peak_megabytes() { return static_cast<double>(counters().PeakWorkingSetSize) / 1e6; }

void reset_peak_memory() {}  // Windows has nothing for it

}  // namespace defrec::cli
