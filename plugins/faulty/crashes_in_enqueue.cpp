// Enqueue of rectify ends the process.
#include <csignal>

#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
const Fault fault{.change = [](Tables& tables) {
    tables.stages[DEFREC_STAGE_RECTIFY].enqueue =
        [](defrec_pstage*, defrec_pqueue*, defrec_pbuffer* const*, size_t, defrec_pbuffer* const*,
           size_t) -> defrec_status {
        std::raise(SIGSEGV);
        return DEFREC_ERROR_INTERNAL;
    };
}};
}  // namespace defrec::faulty
