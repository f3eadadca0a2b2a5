// A queue that computes on a thread of its own, later than it was asked to: what a device does. It
// waits as it should, or claims at once that everything is done.
#pragma once
#include "plugins/faulty/frame.hpp"

namespace defrec::faulty {

enum class Wait { until_done, not_at_all };

// Puts it into the tables; once in a process.
void make_asynchronous(Tables& tables, Wait wait);

}  // namespace defrec::faulty
