// See computer.hpp.
#include <unistd.h>

#include <fstream>

#include "plugins/base/computer.hpp"
#include "plugins/base/processor_name.hpp"

namespace defrec {

std::string processor_name() {
    std::ifstream cpuinfo("/proc/cpuinfo");
    return processor_name(cpuinfo);
}

uint64_t memory_bytes() {
    return static_cast<uint64_t>(sysconf(_SC_PHYS_PAGES)) *
           static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace defrec
