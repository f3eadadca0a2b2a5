// Disparity images beyond what 32 bits count are refused when a stage is made.
#include "backends/cpu/disparity_bytes.hpp"

#include <doctest/doctest.h>

#include "backends/cpu/stages.hpp"
#include "backends/shared/test_host.hpp"

using namespace defrec;

namespace {

// Whether the maker refuses as unsupported.
template <class Params>
bool refused(std::unique_ptr<Stage> (*make)(const Params&, const Host&), uint32_t height,
             uint32_t width) {
    Params params{};
    params.stride = 1u << 20;
    params.width = width;
    params.height = height;
    params.camera = {500, 500, 100, 100, 4, 0};
    fill_defaults(params);
    const test::TestHost host;
    try {
        make(params, host.host());
    } catch (const StageError& error) {
        CHECK(error.status() == DEFREC_ERROR_UNSUPPORTED);
        CHECK(doctest::String(error.what()) == doctest::Contains("at most 1073741824"));
        return true;
    }
    return false;
}

}  // namespace

TEST_CASE("lm and warp refuse disparity images of more than 2^31 bytes") {
    for (const uint32_t width : {2u, 300u}) {
        CHECK_FALSE(refused(cpu::make_lm, 1024, width));
        CHECK_FALSE(refused(cpu::make_warp, 1024, width));
        CHECK(refused(cpu::make_lm, 1025, width));
        CHECK(refused(cpu::make_warp, 1025, width));
    }
    CHECK(refused(cpu::make_warp, DEFREC_MAX_SIDE, DEFREC_MAX_SIDE));
}
