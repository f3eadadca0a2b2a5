#include "sdk/tracking/monitors/backoff.hpp"

#include <doctest/doctest.h>

#include <string>

using defrec::Backoff;

namespace {

// t: tried, -: left out, of so many occasions.
std::string tried(Backoff& backoff, int occasions, bool succeeds) {
    std::string result;
    for (int i = 0; i < occasions; ++i) {
        const bool is_due = backoff.is_due();
        if (is_due) backoff.end(succeeds);
        result += is_due ? 't' : '-';
    }
    return result;
}

}  // namespace

TEST_CASE("what fails is tried less and less often, what succeeds every time") {
    Backoff backoff(4);
    CHECK(tried(backoff, 3, true) == "ttt");
    CHECK(tried(backoff, 18, false) == "t-t--t----t----t--");
    CHECK(tried(backoff, 5, true) == "--ttt");
    CHECK(tried(backoff, 3, false) == "t-t");
}
