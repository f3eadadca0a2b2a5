// Buffers come with what was in the memory before.
#include <vector>

#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
const Fault fault{.change = [](Tables& tables) {
    tables.plugin.buffer_create = [](defrec_pdevice* device, uint64_t size, defrec_pbuffer** out) {
        defrec_pqueue* queue = nullptr;
        defrec_status status = good.plugin.queue_create(device, &queue);
        if (status != DEFREC_OK) return status;
        status = good.plugin.buffer_create(device, size, out);
        if (status == DEFREC_OK) {
            const std::vector<unsigned char> before(size, 0xCD);
            good.plugin.write(queue, *out, 0, before.data(), size);
        }
        good.plugin.queue_destroy(queue);
        return status;
    };
}};
}  // namespace defrec::faulty
