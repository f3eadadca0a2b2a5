// An imported buffer is a copy of the caller's memory.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
const Fault fault{.change = [](Tables& tables) {
    tables.plugin.buffer_import = [](defrec_pdevice* device, uint32_t kind, void* memory,
                                     uint64_t size, defrec_pbuffer** out) {
        defrec_pbuffer* imported = nullptr;
        defrec_status status = good.plugin.buffer_import(device, kind, memory, size, &imported);
        if (status != DEFREC_OK) return status;
        good.plugin.buffer_destroy(imported);
        defrec_pqueue* queue = nullptr;
        status = good.plugin.queue_create(device, &queue);
        if (status != DEFREC_OK) return status;
        status = good.plugin.buffer_create(device, size, out);
        if (status == DEFREC_OK) good.plugin.write(queue, *out, 0, memory, size);
        good.plugin.queue_destroy(queue);
        return status;
    };
}};
}  // namespace defrec::faulty
