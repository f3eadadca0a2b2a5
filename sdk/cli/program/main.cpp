// The program `defrec`.
#include "sdk/cli/program/commands.hpp"
#include "sdk/cli/program/interrupt.hpp"

int main(int argc, char** argv) {
    defrec::cli::install_signal_handlers();
    return defrec::cli::run_program(argc, argv);
}
