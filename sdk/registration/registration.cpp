// See registration.hpp.
#include "sdk/registration/registration.hpp"

namespace defrec {

const char* name_of(RegistrationVerdict verdict) {
    switch (verdict) {
        case RegistrationVerdict::kRegistered:
            return "registered";
        case RegistrationVerdict::kAmbiguous:
            return "ambiguous";
        case RegistrationVerdict::kUndetermined:
            return "undetermined";
        default:
            return "failed";
    }
}

}  // namespace defrec
