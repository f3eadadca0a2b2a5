// Wait says that work is done which has not begun.
#include "plugins/faulty/asynchronous_queue.hpp"

namespace defrec::faulty {
const Fault fault{.change = [](Tables& tables) { make_asynchronous(tables, Wait::not_at_all); }};
}  // namespace defrec::faulty
