// Patches that are not found are not compared where they are predicted.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
const Fault fault = ignores<&defrec_align_params::keep_predicted>();
}  // namespace defrec::faulty
