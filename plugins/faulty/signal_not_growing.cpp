// Every signal gives the same value.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
const Fault fault{.change = [](Tables& tables) {
    tables.plugin.signal = [](defrec_pqueue* queue, uint64_t* out) {
        uint64_t growing = 0;
        const defrec_status status = good.plugin.signal(queue, &growing);
        *out = 1;
        return status;
    };
}};
}  // namespace defrec::faulty
