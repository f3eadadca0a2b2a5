// The program defrec_tolerances [BACKEND]: prints what the tolerances of the stage tier are derived
// from, and how far a backend's results are.
#include <cstdio>
#include <exception>

#include "conformance/tolerances/derive.hpp"

int main(int argc, char** argv) {
    try {
        defrec::conformance::print_derived_tolerances(argc > 1 ? argv[1] : "");
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "defrec_tolerances: %s.\n", error.what());
        return 1;
    }
}
