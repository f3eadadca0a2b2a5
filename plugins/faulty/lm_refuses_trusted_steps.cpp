// The last step is taken only where it lowers the cost, though it is to be trusted.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
const Fault fault = ignores<&defrec_lm_params::trust_last_step>();
}  // namespace defrec::faulty
