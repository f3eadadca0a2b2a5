#include "conformance/runner/examine.hpp"

#include <doctest/doctest.h>

using namespace defrec::conformance;

TEST_CASE("the short list is repeated twice, everything else three times") {
    RunOptions options;
    CHECK(settings_of(options).repetitions == 3);
    options.tiers = {"stage"};
    CHECK(settings_of(options).repetitions == 3);
    options = {};
    options.smoke = true;
    CHECK(settings_of(options).repetitions == 2);
}
