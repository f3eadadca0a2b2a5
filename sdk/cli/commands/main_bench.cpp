// The program `defrec-bench`.
#include "sdk/cli/commands/commands.hpp"
#include "sdk/io/interrupt.hpp"

int main(int argc, char** argv) {
    defrec::cli::install_signal_handlers();
    return defrec::cli::run_bench_program(argc, argv);
}
