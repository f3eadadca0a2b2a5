// The command line of defrec-conformance.
#pragma once

namespace defrec::conformance {

// Exit codes, those of the program defrec.
enum class ExitCode : int {
    passed = 0,
    internal = 1,
    usage = 2,
    unavailable = 5,
    failed = 6,
    output = 7
};

int run_program(int argc, const char* const* argv);

}  // namespace defrec::conformance
