// Runs `defrec` in a test's own process.
#pragma once

#include <string>
#include <vector>

#include "sdk/cli/commands/commands.hpp"

namespace defrec::cli {

// The exit code. arguments: after the program's name.
inline int run(const std::vector<std::string>& arguments) {
    std::vector<const char*> argv{"defrec"};
    for (const std::string& argument : arguments) argv.push_back(argument.c_str());
    return run_program(static_cast<int>(argv.size()), argv.data());
}

}  // namespace defrec::cli
