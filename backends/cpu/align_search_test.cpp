// The search of align on the CPU, whose memory is not cleared before.
#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <memory>

#include "backends/cpu/align_kernels.hpp"
#include "backends/cpu/under_test.hpp"
#include "backends/shared/align_view.hpp"
#include "backends/shared/test_align.hpp"

using namespace defrec;
using namespace defrec::test;

TEST_CASE("patches are found where they are, whatever was in the search's memory before") {
    for (const uint32_t search : {1u, 4u, 7u}) {
        CAPTURE(search);
        AlignSceneOptions options;
        options.search_radius = search;
        options.stride = options.width;
        options.prediction_error = 0.4;
        const AlignScene scene = make_align_scene(options);
        const defrec_align_params& params = scene.params;
        const int32_t width = int32_t(params.width), height = int32_t(params.height);
        std::vector<uint8_t> doubled(size_t(4) * size_t(width) * size_t(height) +
                                     cpu::kAlignViewSlack);
        align::double_size(scene.view.data(), width, height, params.stride, doubled.data());
        const cpu::AlignView view{doubled.data(), 2 * width, 2 * height};
        std::vector<float> inverse, root;
        for (int n = 1; n <= cpu::kAlignRows * cpu::kAlignRows; ++n) {
            inverse.push_back(1.0f / float(n));
            root.push_back(std::sqrt(float(n)));
        }
        const TestHost host;
        const cpu::AlignPlaces places(params, host.host());
        const cpu::AlignRun run{
            &params,
            {scene.live.data(), nullptr, width, height, params.stride, scene.live.size()},
            &view,
            inverse.data(),
            root.data(),
            &places};
        const auto scratch = std::make_unique<cpu::AlignScratch>();
        under_test::on_every_target([&] {
            std::mt19937 random(search);
            size_t found_otherwise = 0;
            for (size_t i = 0; i < scene.patches.size(); ++i) {
                const AlignCentre centre = align::centre_of(scene.patches[i], params.level);
                std::memset(scratch.get(), 0, sizeof *scratch);
                cpu::AlignPeak expected{}, got{};
                const bool found =
                    cpu::align_search(run, centre, scene.predictions[i], *scratch, expected);
                for (size_t k = 0; k < sizeof *scratch; k += sizeof(uint32_t)) {
                    const uint32_t anything = random() >> random() % 32;
                    std::memcpy(reinterpret_cast<char*>(scratch.get()) + k, &anything,
                                sizeof anything);
                }
                scratch->masked = false;
                found_otherwise +=
                    cpu::align_search(run, centre, scene.predictions[i], *scratch, got) != found ||
                    got.x != expected.x || got.y != expected.y;
            }
            CHECK(found_otherwise == 0);
        });
    }
}
