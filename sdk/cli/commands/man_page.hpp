// The manual pages of `defrec`, from the definitions of its commands and options.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace defrec::cli {

// defrec-COMMAND(1), in the macros of man(7), with all of the command's options.
std::string man_page(const CLI::App& command, const std::string& version);

// defrec(1): the program's commands, each with its page.
std::string man_page_of_program(const CLI::App& program, const std::string& version);

}  // namespace defrec::cli
