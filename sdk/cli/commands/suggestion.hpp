// What is said of a command line that cannot be carried out: "there is no command 'trak'. Did you
// mean track?"
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace defrec::cli {

// The words on the first command or option that does not exist, or on a file that stands where an
// option should; empty where there is none, or where it is for the parser to say.
std::string misspelling(const CLI::App& app, int argc, const char* const* argv);

// What a command line lacks whose options were parsed: the command, with a list of all, or the
// options that the command requires, with an example. Empty where nothing is lacking.
std::string what_is_missing(const CLI::App& app, int argc, const char* const* argv);

}  // namespace defrec::cli
