// See computer.hpp.
#include <windows.h>

#include "plugins/base/computer.hpp"

namespace defrec {

std::string processor_name() {
    char name[256];
    DWORD size = sizeof name;
    if (RegGetValueA(HKEY_LOCAL_MACHINE, "HARDWARE\\DESCRIPTION\\System\\CentralProcessor\\0",
                     "ProcessorNameString", RRF_RT_REG_SZ, nullptr, name, &size) != ERROR_SUCCESS)
        return "Processor";
    const std::string text = name;
    const size_t first = text.find_first_not_of(' ');
    if (first == std::string::npos) return "Processor";
    return text.substr(first, text.find_last_not_of(' ') + 1 - first);
}

uint64_t memory_bytes() {
    MEMORYSTATUSEX status{};
    status.dwLength = sizeof status;
    return GlobalMemoryStatusEx(&status) != 0 ? status.ullTotalPhys : 0;
}

}  // namespace defrec
