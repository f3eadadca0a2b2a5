// The stages orb and match of the CPU backend, called directly.
#include "backends/benchmarks/orb_features.hpp"

#include <algorithm>
#include <cstring>
#include <ctime>

#include "backends/cpu/stages.hpp"
#include "backends/definition/orb_definition.hpp"
#include "backends/shared/test_host.hpp"
#include "sdk/base/util/median.hpp"
#include "sdk/contract/stage_params.hpp"

namespace defrec::benchmarks {

OrbResult orb_features(const GrayImage& image, uint32_t capacity, int repeat) {
    const test::TestHost host(1);
    defrec_orb_params params;
    DEFREC_INIT(&params);
    params.width = image.width;
    params.height = image.height;
    params.capacity = capacity;
    fill_defaults(params);
    const auto stage = cpu::make_orb(params, host.host());
    OrbResult result;
    result.features.resize(capacity);
    result.smoothed.resize(orb::make_layout(params).pixels);
    uint32_t count = 0;
    const InBuffer in[] = {{image.pixels.data(), image.pixels.size()}};
    const OutBuffer out[] = {{&count, sizeof count},
                             {result.features.data(), capacity * sizeof(defrec_feature)}};
    std::vector<double> times;
    for (int i = 0; i < repeat; ++i) {
        const std::clock_t start = std::clock();
        stage->run(in, out);
        times.push_back(1e3 * double(std::clock() - start) / CLOCKS_PER_SEC);
    }
    result.milliseconds = median(std::move(times));
    const OutBuffer with_smoothed[] = {
        out[0], out[1], {}, {result.smoothed.data(), result.smoothed.size() * sizeof(uint16_t)}};
    stage->run(in, with_smoothed);
    result.features.resize(count);
    return result;
}

std::vector<defrec_match> match_features(const std::vector<defrec_feature>& first,
                                         const std::vector<defrec_feature>& second) {
    if (first.empty() || second.empty())
        return std::vector<defrec_match>(first.size(), defrec_match{-1, 256, 256, 0, 0, {}, 0, 0});
    const test::TestHost host(1);
    defrec_match_params params;
    DEFREC_INIT(&params);
    params.landmarks = uint32_t(first.size());
    params.features = uint32_t(second.size());
    params.width = params.height = 2;
    params.camera = {1, 1, 0, 0, 1, 0};
    fill_defaults(params);
    const auto stage = cpu::make_match(params, host.host());
    std::vector<defrec_landmark> landmarks(first.size());
    for (size_t i = 0; i < first.size(); ++i)
        std::memcpy(landmarks[i].descriptor, first[i].descriptor, sizeof landmarks[i].descriptor);
    const InBuffer given[] = {{landmarks.data(), landmarks.size() * sizeof(defrec_landmark)}};
    stage->prepare(given);
    const auto count = uint32_t(second.size());
    const std::vector<int16_t> disparity(4, int16_t{DEFREC_DISPARITY_NONE});
    std::vector<defrec_match> matches(first.size());
    const InBuffer in[] = {{&count, sizeof count},
                           {second.data(), second.size() * sizeof(defrec_feature)},
                           {disparity.data(), disparity.size() * sizeof(int16_t)}};
    const OutBuffer out[] = {{matches.data(), matches.size() * sizeof(defrec_match)}};
    stage->run(in, out);
    return matches;
}

}  // namespace defrec::benchmarks
