// See sequence_list.hpp.
#include "conformance/cases/sequence/sequence_list.hpp"

#include "sdk/base/util/error.hpp"

namespace defrec::conformance {

std::string SequenceEntry::error_limits() const {
    if (hazy) return "hazy";
    if (late) return "late";
    return concat(sequence.width, "x", sequence.height);
}

std::span<const SequenceEntry> sequence_list() {
    static const SequenceEntry kList[] = {
        {{"heartbeat", 360, 288, 6},
         "A beating organ, small pictures: as exact as stated, and as the reference has it.",
         true},
        {{"out-of-body", 360, 288, 9},
         "The camera leaves the body and returns: lost at once, found again, never invented.",
         true},
        {{"heartbeat", 640, 360, 12},
         "A beating organ: as exact as stated, and as the reference has it."},
        {{"respiration", 640, 360, 12},
         "Breathing seen through distorted lenses: as exact as stated, and as the reference has "
         "it."},
        {{"indentation", 640, 360, 12},
         "An instrument presses and drags the tissue: as exact as stated, and as the reference has "
         "it."},
        {{"fast-cut", 640, 360, 12},
         "Two cuts to another view: as exact as stated, and as the reference has it."},
        {{"out-of-body", 640, 360, 12},
         "The camera leaves the body and returns: lost at once, found again, never invented."},
        {{"smoke", 640, 360, 12},
         "A smooth organ behind smoke: as exact as stated, and as the reference has it.",
         false,
         true},
        {{"stretch", 640, 360, 12},
         "Tissue pulled by a third: as exact as stated, and as the reference has it."},
        {.sequence = {"pinch", 640, 360, 12},
         .title = "Tissue drawn together under an instrument: as exact as stated, and as the "
                  "reference has it."},
        {.sequence = {"late-view", 640, 360, 12},
         .title = "A right view that is late for a while: noticed, and as the reference has it.",
         .late = true},
        {.sequence = {"lobes", 640, 360, 12},
         .title = "Two lobes that slide on each other: a piece of the surface each, as exact as "
                  "stated, and as the reference has them."},
        {.sequence = {"cut", 640, 360, 24},
         .title = "A cut that opens: noticed, and as the reference has it.",
         .reason = DEFREC_REASON_CUT},
        {.sequence = {"slide", 360, 288, 20, true},
         .title = "A camera that slides along tissue: the template grows, and is as the reference "
                  "has it.",
         .reason = DEFREC_REASON_TEMPLATE_GREW},
        {{"heartbeat", 960, 540, 12},
         "A beating organ at the full size: as exact as stated, and as the reference has it."},
    };
    return kList;
}

}  // namespace defrec::conformance
