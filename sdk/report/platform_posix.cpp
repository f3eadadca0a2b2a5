// POSIX, as Linux has it.
#include <sys/resource.h>

#include "sdk/report/platform.hpp"

namespace defrec::cli {

void lower_this_threads_priority() {
    // On Linux a nice value belongs to a thread, and 0 names the calling one.
    static_cast<void>(setpriority(PRIO_PROCESS, 0, 10));
}

}  // namespace defrec::cli
