// Carries out what the user asked for, whatever happens.
#pragma once

#include <functional>

namespace CLI {
class App;
}

namespace defrec::cli {

// Parses, calls `run`, which the chosen subcommand has set, and prints what was thrown; returns the
// exit code.
int carry_out(CLI::App& app, const std::function<int()>& run, int argc, const char* const* argv);

}  // namespace defrec::cli
