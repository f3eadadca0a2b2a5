// After enqueue the thread rounds upwards.
#include <cfenv>

#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
const Fault fault{.change = [](Tables& tables) {
    for (defrec_stage_table& stage : tables.stages)
        stage.enqueue = [](defrec_pstage* object, defrec_pqueue* queue, defrec_pbuffer* const* in,
                           size_t in_count, defrec_pbuffer* const* out, size_t out_count) {
            const defrec_status status =
                good.stages[0].enqueue(object, queue, in, in_count, out, out_count);
            std::fesetround(FE_UPWARD);
            return status;
        };
}};
}  // namespace defrec::faulty
