// The control of wait_returns_early: the same queue, and it waits.
#include "plugins/faulty/asynchronous_queue.hpp"

namespace defrec::faulty {
const Fault fault{.change = [](Tables& tables) { make_asynchronous(tables, Wait::until_done); }};
}  // namespace defrec::faulty
