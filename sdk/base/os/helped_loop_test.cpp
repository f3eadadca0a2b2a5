// Loops that other threads help with.
#include "sdk/base/os/helped_loop.hpp"

#include <doctest/doctest.h>

#include <new>
#include <vector>

#include "sdk/base/os/services.hpp"

using namespace defrec;

TEST_CASE("a loop reaches each index once, and passes on that memory ran out") {
    defrec_context_desc desc{};
    desc.threads = 3;
    const Services services(desc);
    for (const Services* helpers : {static_cast<const Services*>(nullptr), &services})
        for (const size_t count : {size_t{0}, size_t{1}, size_t{16}, size_t{17}}) {
            CAPTURE(count);
            std::vector<int> calls(count);
            helped_runs(helpers, count, 8, [&](size_t begin, size_t end) {
                for (size_t i = begin; i < end; ++i) ++calls[i];
            });
            CHECK(calls == std::vector<int>(count, 1));
            const auto run_out = [&](size_t i) {
                if (i + 1 == count) throw std::bad_alloc();
            };
            if (count == 0)
                CHECK_NOTHROW(helped_loop(helpers, count, run_out));
            else
                CHECK_THROWS_AS(helped_loop(helpers, count, run_out), std::bad_alloc);
        }
}
