// Spoils CUDA for the process, as a faulty kernel of anybody's would.
#pragma once

namespace defrec::test {

enum class Fault { trap, address };
// Runs a kernel that ends so on the device, and waits for it. False: the device took it for well.
bool cause(Fault fault, int ordinal);

}  // namespace defrec::test
