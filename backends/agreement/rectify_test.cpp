// rectify equals the reference to the bit: formats, odd sizes, strides, maps, ignore images, thread
// counts.
#include <doctest/doctest.h>

#include <algorithm>
#include <random>

#include "backends/reference/stages.hpp"
#include "backends/shared/test_host.hpp"
#include "sdk/contract/parameter_ends.hpp"
#include "sdk/contract/stage_params.hpp"
#include DEFREC_UNDER_TEST

namespace defrec {
namespace {

struct Input {
    defrec_rectify_params params{};
    std::vector<uint8_t> source, ignore;
    std::vector<int32_t> map;
};

Input random_input(uint32_t format, uint32_t width, uint32_t height, uint32_t padding, bool map,
                   bool ignore) {
    std::mt19937 random(width * 31 + format);
    Input input;
    defrec_rectify_params& p = input.params;
    p.format = format;
    p.source_width = width;
    p.source_height = height;
    p.source_stride = width * bytes_per_pixel(format) + padding;
    p.width = map ? width + 5 : width;
    p.height = map ? height - 3 : height;
    p.stride = p.width + padding;
    p.highlight_radius = width % 2 == 0 ? 3 : 4;
    fill_defaults(p);
    input.source.resize(size_t(p.source_stride) * height);
    for (uint8_t& value : input.source) value = uint8_t(random() % 251);
    for (int i = 0; i < 9; ++i)
        std::fill_n(input.source.begin() + random() % (input.source.size() - 12), 12, uint8_t{255});
    if (ignore)
        for (size_t i = 0; i < size_t(width) * height; ++i)
            input.ignore.push_back(random() % 50 == 0);
    if (map)
        for (uint32_t y = 0; y < p.height; ++y)
            for (uint32_t x = 0; x < p.width; ++x) {
                input.map.push_back(int32_t(x * 128) + int32_t(random() % 400) - 250);
                input.map.push_back(random() % 100 == 0
                                        ? INT32_MIN
                                        : int32_t(y * 128) + int32_t(random() % 800) - 200);
            }
    return input;
}

std::vector<uint8_t> run(Stage& stage, const Input& input) {
    const size_t size = size_t(input.params.stride) * input.params.height;
    std::vector<uint8_t> both(2 * size, 99);
    const InBuffer in[] = {
        {input.source.data(), input.source.size()},
        {input.map.empty() ? nullptr : input.map.data(), input.map.size() * 4},
        {input.ignore.empty() ? nullptr : input.ignore.data(), input.ignore.size()}};
    const OutBuffer out[] = {{both.data(), size}, {both.data() + size, size}};
    stage.run(in, out);
    return both;
}

TEST_CASE("rectify equals the reference to the bit") {
    if (!under_test::available()) return;
    const test::TestHost one(1), three(3);
    for (const uint32_t format :
         {DEFREC_FORMAT_GRAY8, DEFREC_FORMAT_BGR8, DEFREC_FORMAT_RGB8, DEFREC_FORMAT_BGRA8})
        for (const auto& size : {std::pair{64u, 48u}, {311u, 239u}, {17u, 9u}, {129u, 65u}})
            for (const bool map : {false, true})
                for (const bool ignore : {false, true}) {
                    const uint32_t width = size.first, height = size.second;
                    CAPTURE(format);
                    CAPTURE(width);
                    CAPTURE(map);
                    CAPTURE(ignore);
                    const Input input = random_input(format, width, height, width % 7, map, ignore);
                    const auto truth =
                        run(*reference::make_rectify(input.params, one.host()), input);
                    CHECK(
                        (run(*under_test::make_rectify(input.params, one.host()), input) == truth));
                    CHECK((run(*under_test::make_rectify(input.params, three.host()), input) ==
                           truth));
                }
}

TEST_CASE("rectify equals the reference to the bit with each parameter at the ends of its range") {
    if (!under_test::available()) return;
    const test::TestHost host;
    Input input = random_input(DEFREC_FORMAT_BGR8, 129, 65, 3, true, true);
    for_parameter_ends(defrec_rectify_params(input.params),
                       [&](const char* name, const defrec_rectify_params& params) {
                           CAPTURE(name);
                           input.params = params;
                           CHECK((run(*under_test::make_rectify(params, host.host()), input) ==
                                  run(*reference::make_rectify(params, host.host()), input)));
                       });
}

TEST_CASE("without a saturation limit no highlight is masked") {
    if (!under_test::available()) return;
    const test::TestHost host;
    Input input = random_input(DEFREC_FORMAT_GRAY8, 100, 50, 0, false, false);
    for (const uint32_t saturation : {256u, UINT32_MAX}) {
        input.params.saturation = saturation;
        const auto result = run(*under_test::make_rectify(input.params, host.host()), input);
        CHECK(std::count(result.begin() + 5000, result.end(), 255) == 5000);
    }
}

}  // namespace
}  // namespace defrec
