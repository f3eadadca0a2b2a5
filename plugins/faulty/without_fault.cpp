// The control: the frame without any fault.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
const Fault fault{};
}  // namespace defrec::faulty
