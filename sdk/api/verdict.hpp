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

inline uint32_t deformation_verdict_of(DeformationVerdict verdict) {
    switch (verdict) {
        case DeformationVerdict::kApplied:
            return DEFREC_DEFORMATION_APPLIED;
        case DeformationVerdict::kRefused:
            return DEFREC_DEFORMATION_REFUSED;
        default:
            return DEFREC_DEFORMATION_NOT_ASKED;
    }
}

}  // namespace defrec
