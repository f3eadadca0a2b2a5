// How much memory this process holds.
#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <memory>

#include "sdk/io/process_memory.hpp"

namespace defrec::cli {

double resident_megabytes() {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen("/proc/self/statm", "r"),
                                                               &std::fclose);
    long total = 0, resident = 0;
    if (!file || std::fscanf(file.get(), "%ld %ld", &total, &resident) != 2) return 0;
    return static_cast<double>(resident) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

double peak_megabytes() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return static_cast<double>(usage.ru_maxrss) * 1024 / 1e6;
}

void reset_peak_memory() {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(
        std::fopen("/proc/self/clear_refs", "w"), &std::fclose);
    if (file) std::fputs("5", file.get());
}

}  // namespace defrec::cli
