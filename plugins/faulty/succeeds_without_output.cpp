// Creating a stage succeeds, and gives none.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
const Fault fault{.change = [](Tables& tables) {
    for (defrec_stage_table& stage : tables.stages)
        stage.create = [](defrec_pdevice*, const void*, defrec_pstage**) -> defrec_status {
            return DEFREC_OK;
        };
}};
}  // namespace defrec::faulty
