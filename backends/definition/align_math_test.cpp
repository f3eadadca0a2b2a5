// A step of the refinement where the sums are those of no image.
#include "backends/definition/align_math.hpp"

#include <doctest/doctest.h>

using namespace defrec;

TEST_CASE("a correlation a little above 1 is 1, and none is far above it") {
    align::ShiftSystem system{};
    system.tt = 1e6f;
    system.inverse_tt = 1e-6f;
    system.xx = system.yy = 10;
    system.inverse_determinant = 0.01f;
    system.solvable = true;
    const auto step = [&](int32_t product) {
        align::LiveSums live;
        live.ii = 1000000;
        live.it = product;
        return align::shift_step(system, live);
    };
    CHECK(step(900000).valid);
    CHECK(step(900000).score == 58982);
    CHECK(step(1000500).valid);
    CHECK(step(1000500).score == 65536);
    CHECK_FALSE(step(1002000).valid);
    CHECK_FALSE(step(3000000).valid);
}
