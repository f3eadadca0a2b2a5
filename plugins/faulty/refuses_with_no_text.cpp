// What it refuses, it refuses without an error message.
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {
const Fault fault{.change_host = [](defrec_host& host) { host.error = [](void*, const char*) {}; }};
}  // namespace defrec::faulty
