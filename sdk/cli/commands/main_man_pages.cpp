// Writes the manual pages of `defrec` and its commands, for the build: defrec-man-pages FOLDER
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <functional>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/cli/commands/commands.hpp"
#include "sdk/cli/commands/man_page.hpp"
#include "sdk/client/library.hpp"

int main(int argc, char** argv) {
    using namespace defrec::cli;
    if (argc != 2) {
        std::fputs("usage: defrec-man-pages FOLDER\n", stderr);
        return 2;
    }
    try {
        const std::string folder = std::string(argv[1]) + "/", version = defrec_version_string();
        CLI::App app;
        std::function<int()> run;
        add_commands(app, run);
        defrec::write_atomically(folder + "defrec.1", man_page_of_program(app, version));
        for (const CLI::App* command : app.get_subcommands({}))
            defrec::write_atomically(folder + "defrec-" + command->get_name() + ".1",
                                     man_page(*command, version));
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "defrec-man-pages: %s\n", error.what());
        return 1;
    }
}
