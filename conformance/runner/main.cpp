// The program defrec-conformance.
#include "conformance/runner/program.hpp"

int main(int argc, char** argv) { return defrec::conformance::run_program(argc, argv); }
