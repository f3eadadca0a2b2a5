// A read is rounded up to whole words of four bytes.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
const Fault fault{.change = [](Tables& tables) {
    tables.plugin.read = [](defrec_pqueue* queue, defrec_pbuffer* buffer, uint64_t offset,
                            void* dst, uint64_t size) {
        const defrec_status status = good.plugin.read(queue, buffer, offset, dst, size);
        for (uint64_t i = size; status == DEFREC_OK && i % 4 != 0; ++i)
            static_cast<unsigned char*>(dst)[i] = 0;
        return status;
    };
}};
}  // namespace defrec::faulty
