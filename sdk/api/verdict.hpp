// A registration's verdict as the header has it.
#pragma once
#include "sdk/api/objects.hpp"

namespace defrec {

inline uint32_t verdict_of(RegistrationVerdict verdict) {
    switch (verdict) {
        case RegistrationVerdict::kRegistered:
            return DEFREC_VERDICT_ACCEPTED;
        case RegistrationVerdict::kAmbiguous:
            return DEFREC_VERDICT_AMBIGUOUS;
        case RegistrationVerdict::kUndetermined:
            return DEFREC_VERDICT_UNDETERMINED;
        default:
            return DEFREC_VERDICT_FAILED;
    }
}

}  // namespace defrec
