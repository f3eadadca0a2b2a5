// The program `defrec-bench`.
#include "sdk/cli/program/commands.hpp"
#include "sdk/cli/program/interrupt.hpp"

int main(int argc, char** argv) {
    defrec::cli::install_signal_handlers();
    return defrec::cli::run_bench_program(argc, argv);
}
