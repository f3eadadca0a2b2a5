// Features are of the image as it is where those of the halved image are asked for.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
const Fault fault = ignores<&defrec_orb_params::halvings>();
}  // namespace defrec::faulty
