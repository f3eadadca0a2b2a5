// The one thing the report needs of the operating system beyond the standard library.
#pragma once

namespace defrec::cli {

/// Lets the calling thread, and those it starts from now on, give way to the program's others. Best
/// effort.
void lower_this_threads_priority();

}  // namespace defrec::cli
