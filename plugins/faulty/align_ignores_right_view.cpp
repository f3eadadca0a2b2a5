// Patches are predicted into the left view where the right one is asked for.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
const Fault fault = ignores<&defrec_align_params::right_view>();
}  // namespace defrec::faulty
