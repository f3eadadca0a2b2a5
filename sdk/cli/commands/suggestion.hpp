// Names that were probably meant: "unknown command 'trak'. Did you mean track?"
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace defrec::cli {

// The words on the first command or option that does not exist, or on a file that stands where an
// option should; empty where there is none, or where it is for the parser to say.
std::string misspelling(const CLI::App& app, int argc, const char* const* argv);

}  // namespace defrec::cli
