// Properties of the definition of rectify, on small images worked out by hand.
#include <doctest/doctest.h>

#include "backends/reference/stages.hpp"
#include "backends/shared/test_host.hpp"
#include "sdk/contract/stage_params.hpp"

namespace defrec {
namespace {

struct Result {
    std::vector<uint8_t> gray, mask;
};

defrec_rectify_params params_of(uint32_t format, uint32_t width, uint32_t height) {
    defrec_rectify_params params{};
    params.format = format;
    params.source_width = width;
    params.source_height = height;
    return params;
}

Result run(defrec_rectify_params params, const std::vector<uint8_t>& source,
           const std::vector<int32_t>& map = {}, const std::vector<uint8_t>& ignore = {}) {
    fill_defaults(params);
    test::TestHost host;
    Result result;
    result.gray.assign(size_t(params.stride) * params.height, 7);
    result.mask = result.gray;
    const InBuffer in[] = {{source.data(), source.size()},
                           {map.empty() ? nullptr : map.data(), map.size() * 4},
                           {ignore.empty() ? nullptr : ignore.data(), ignore.size()}};
    const OutBuffer out[] = {{result.gray.data(), result.gray.size()},
                             {result.mask.data(), result.mask.size()}};
    reference::make_rectify(params, host.host())->run(in, out);
    return result;
}

TEST_CASE("gray weighs red, green and blue by BT.601 in every format") {
    CHECK(run(params_of(DEFREC_FORMAT_RGB8, 3, 1), {255, 0, 0, 0, 255, 0, 0, 0, 255}).gray ==
          std::vector<uint8_t>{77, 149, 29});
    CHECK(run(params_of(DEFREC_FORMAT_BGR8, 3, 1), {255, 0, 0, 0, 255, 0, 0, 0, 255}).gray ==
          std::vector<uint8_t>{29, 149, 77});
    CHECK(run(params_of(DEFREC_FORMAT_BGRA8, 1, 1), {255, 255, 255, 3}).gray ==
          std::vector<uint8_t>{255});
    CHECK(run(params_of(DEFREC_FORMAT_GRAY8, 2, 1), {9, 11}).gray == std::vector<uint8_t>{9, 11});
}

TEST_CASE("a map samples between pixels, up to and including the last one") {
    defrec_rectify_params params = params_of(DEFREC_FORMAT_GRAY8, 2, 2);
    params.width = 6;
    params.height = 1;
    const std::vector<uint8_t> source{0, 100, 40, 200};
    const Result result =
        run(params, source, {64, 0, 0, 64, 64, 64, 128, 128, 129, 0, INT32_MIN, INT32_MIN});
    CHECK(result.gray == std::vector<uint8_t>{50, 20, 85, 200, 0, 0});
    CHECK(result.mask == std::vector<uint8_t>{255, 255, 255, 255, 0, 0});
}

TEST_CASE("ignored source pixels are masked where they are sampled") {
    defrec_rectify_params params = params_of(DEFREC_FORMAT_GRAY8, 3, 1);
    const std::vector<uint8_t> source{1, 2, 3};
    CHECK(run(params, source, {}, {0, 1, 0}).mask == std::vector<uint8_t>{255, 0, 255});
    params.width = 2;
    CHECK(run(params, source, {0, 0, 129, 0}, {0, 0, 9}).mask == std::vector<uint8_t>{255, 0});
}

TEST_CASE("row 61: highlights and their border are masked") {
    defrec_rectify_params params = params_of(DEFREC_FORMAT_GRAY8, 7, 1);
    params.highlight_radius = 1;
    params.saturation = 250;
    const std::vector<uint8_t> source{1, 1, 1, 255, 1, 1, 249};
    CHECK(run(params, source).mask == std::vector<uint8_t>{255, 255, 0, 0, 0, 255, 255});
    params.saturation = 256;
    CHECK(run(params, source).mask == std::vector<uint8_t>(7, 255));
}

TEST_CASE("bytes between rows stay as they are, and short buffers are refused") {
    defrec_rectify_params params = params_of(DEFREC_FORMAT_GRAY8, 2, 2);
    params.source_stride = 3;
    params.stride = 4;
    CHECK(run(params, {1, 2, 99, 3, 4}).gray == std::vector<uint8_t>{1, 2, 7, 7, 3, 4, 7, 7});
    CHECK_THROWS_AS(run(params, {1, 2, 99, 3}), StageError);
    params.source_stride = 1;
    CHECK_THROWS_AS(run(params, {1, 2, 99, 3, 4}), StageError);
    params.format = 77;
    CHECK_THROWS_AS(run(params, {1, 2, 99, 3, 4}), StageError);
}

}  // namespace
}  // namespace defrec
