// Wait never returns, whatever its time limit.
#include <unistd.h>

#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
const Fault fault{.change = [](Tables& tables) {
    tables.plugin.wait = [](defrec_pqueue*, uint64_t, uint64_t) -> defrec_status {
        for (;;) pause();
    };
}};
}  // namespace defrec::faulty
