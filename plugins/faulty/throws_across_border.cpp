// An exception leaves enqueue.
#include <stdexcept>

#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
const Fault fault{.change = [](Tables& tables) {
    for (defrec_stage_table& stage : tables.stages)
        stage.enqueue = [](defrec_pstage*, defrec_pqueue*, defrec_pbuffer* const*, size_t,
                           defrec_pbuffer* const*, size_t) -> defrec_status {
            throw std::runtime_error("thrown across the border");
        };
}};
}  // namespace defrec::faulty
