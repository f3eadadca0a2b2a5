// Each queue leaves a thread behind that nobody joins.
#include <unistd.h>

#include <thread>

#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
const Fault fault{.change = [](Tables& tables) {
    tables.plugin.queue_create = [](defrec_pdevice* device, defrec_pqueue** out) {
        const defrec_status status = good.plugin.queue_create(device, out);
        if (status == DEFREC_OK)
            std::thread([] {
                for (;;) pause();
            }).detach();
        return status;
    };
}};
}  // namespace defrec::faulty
