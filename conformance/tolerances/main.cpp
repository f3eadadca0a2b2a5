// The program defrec_tolerances: prints what the tolerances of the stage tier are derived from.
#include <cstdio>
#include <exception>

#include "conformance/tolerances/derive.hpp"

int main() {
    try {
        defrec::conformance::print_derived_tolerances();
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "defrec_tolerances: %s.\n", error.what());
        return 1;
    }
}
