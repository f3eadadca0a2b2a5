// Bodies that run on several threads at once, and threads that are left over.
#pragma once
#include <cstddef>
#include <functional>

namespace defrec::conformance {

// Runs body(0..count-1), each on a thread of its own, and throws what the first of them threw.
void on_threads(size_t count, const std::function<void(size_t)>& body);

// How many threads there are beyond `known`. A thread that has been joined may still show for a
// moment, which is waited for.
size_t threads_beyond(size_t known);

}  // namespace defrec::conformance
