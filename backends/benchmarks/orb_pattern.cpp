// Derives the test pattern of the stage orb and prints backends/shared/orb_pattern.hpp.
//
// usage: defrec_orb_pattern SCENES     SCENES: a folder with scenes of `defrec render`: heartbeat,
// indentation, stretch, ...
//
// Candidates are pairs of points drawn from a counter-based generator, Gaussian round the feature.
// A test is good if its bit differs between different features and stays the same where a feature
// is found again in a later frame (with the truth of the scene saying where that is, so smoke,
// light, noise, scale and errors of orientation all count). Tests are taken from the best down if
// they are not too correlated with any taken before; the limit is raised until there are 256.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <stdexcept>
#include <string>

#include "backends/benchmarks/image_pairs.hpp"
#include "backends/benchmarks/orb_features.hpp"
#include "backends/definition/orb_definition.hpp"

namespace {

using namespace defrec;
using namespace defrec::benchmarks;

constexpr size_t kCandidates = 20000;
constexpr double kSigma = 8;        // px, of the candidates' points
constexpr int32_t kFarthest = 210;  // squared px: turned and rounded, a point stays within 15 px
constexpr int32_t kShortest = 4;    // squared px between the points of a test
constexpr double kInstability =
    1.5;  // how much a bit that changes counts against one that tells features apart
constexpr double kCorrelation = 0.25;  // the first limit
constexpr uint32_t kCapacity = 1500;   // features for each image

// splitmix64 over a counter (Steele, Lea and Flood 2014).
class Random {
  public:
    double unit() {
        uint64_t z = ++counter_ * 0x9e3779b97f4a7c15u;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return double((z ^ (z >> 31)) >> 11) * 0x1p-53;
    }
    int32_t gaussian() {
        const double radius = std::sqrt(-2 * std::log(1 - unit()));
        return int32_t(std::lround(kSigma * radius * std::cos(2 * M_PI * unit())));
    }
    orb::Offset point() {
        for (;;) {
            const orb::Offset p{gaussian(), gaussian()};
            if (p.x * p.x + p.y * p.y <= kFarthest) return p;
        }
    }

  private:
    uint64_t counter_ = 0;
};

struct Test {
    orb::Offset first, second;
    double goodness = 0, mean = 0;
    std::vector<uint64_t> bits;  // of all training features
};

// A feature's smoothed patch, 31 x 31, and its orientation.
struct Patch {
    std::vector<uint16_t> pixels;
    uint32_t bin;
};
struct Sample {
    Patch patch, again;
};

// The feature's pixel on its level.
int32_t on_level(int32_t sixteenths, uint32_t level) {
    return int32_t(std::lround((sixteenths / 16.0 + 0.5) * std::pow(0.8, level) - 0.5));
}

Patch cut(const GrayImage& image, const OrbResult& result, const defrec_feature& feature) {
    defrec_orb_params params;
    DEFREC_INIT(&params);
    params.width = image.width;
    params.height = image.height;
    params.levels = kOrbMaxLevels;
    params.cell = kOrbMaxCell;
    const orb::Level level = orb::make_layout(params).level[feature.level];
    const int32_t x = on_level(feature.x, feature.level), y = on_level(feature.y, feature.level);
    Patch patch{{}, feature.angle};
    for (int32_t dy = -orb::kPatchRadius; dy <= orb::kPatchRadius; ++dy)
        for (int32_t dx = -orb::kPatchRadius; dx <= orb::kPatchRadius; ++dx)
            patch.pixels.push_back(
                result.smoothed[level.first_pixel + size_t(y + dy) * level.width + size_t(x + dx)]);
    return patch;
}

// Features of the first image that are found again near their true place in the second, on nearly
// the same scale.
void add_samples(const ImagePair& pair, std::vector<Sample>& samples) {
    const OrbResult first = orb_features(pair.first, kCapacity, 1),
                    second = orb_features(pair.second, kCapacity, 1);
    for (const defrec_feature& feature : first.features) {
        const auto place = (*pair.flow)({feature.x / 16.0, feature.y / 16.0});
        if (!place) continue;
        const defrec_feature* found = nullptr;
        double nearest = 1.5 * std::pow(1.25, feature.level);
        for (const defrec_feature& other : second.features) {
            const double away = std::hypot(other.x / 16.0 - place->x, other.y / 16.0 - place->y);
            const int turn = std::abs(int(other.angle) - int(feature.angle));
            if (std::abs(int(other.level) - int(feature.level)) > 1 ||
                std::min(turn, 32 - turn) > 4 || away >= nearest)
                continue;
            nearest = away;
            found = &other;
        }
        if (found)
            samples.push_back({cut(pair.first, first, feature), cut(pair.second, second, *found)});
    }
}

bool outcome(const Test& test, const Patch& patch) {
    // As turned_pattern does; sine and cosine in 1/16384.
    const double angle = patch.bin * 2 * M_PI / double(DEFREC_ORB_ANGLE_BINS);
    const auto c = int32_t(std::lround(16384 * std::cos(angle))),
               s = int32_t(std::lround(16384 * std::sin(angle)));
    const auto at = [&](const orb::Offset& p) {
        const int32_t x = (c * p.x - s * p.y + 8192) >> 14, y = (s * p.x + c * p.y + 8192) >> 14;
        return patch.pixels[size_t((y + orb::kPatchRadius) * 31 + x + orb::kPatchRadius)];
    };
    return at(test.first) < at(test.second);
}

void classify(Test& test, const std::vector<Sample>& samples) {
    test.bits.assign((samples.size() + 63) / 64, 0);
    size_t set = 0, changed = 0;
    for (size_t i = 0; i < samples.size(); ++i) {
        const bool bit = outcome(test, samples[i].patch);
        set += bit;
        changed += bit != outcome(test, samples[i].again);
        test.bits[i / 64] |= uint64_t(bit) << (i % 64);
    }
    const double count = double(samples.size());
    test.mean = double(set) / count;
    test.goodness = 2 * test.mean * (1 - test.mean) - kInstability * double(changed) / count;
}

double correlation(const Test& a, const Test& b, double count) {
    size_t both = 0;
    for (size_t w = 0; w < a.bits.size(); ++w) both += size_t(std::popcount(a.bits[w] & b.bits[w]));
    const double variance = a.mean * (1 - a.mean) * b.mean * (1 - b.mean);
    return (double(both) / count - a.mean * b.mean) / std::sqrt(variance + 1e-12);
}

std::vector<const Test*> choose(const std::vector<Test>& tests, double count) {
    for (double limit = kCorrelation;; limit += 0.01) {
        std::vector<const Test*> chosen;
        for (const Test& test : tests) {
            const auto close = [&](const Test* other) {
                return std::abs(correlation(test, *other, count)) > limit;
            };
            if (std::none_of(chosen.begin(), chosen.end(), close)) chosen.push_back(&test);
            if (chosen.size() == orb::kTests) {
                std::fprintf(stderr, "correlation below %.2f\n", limit);
                return chosen;
            }
        }
    }
}

void print(const std::vector<const Test*>& tests) {
    std::puts(
        "// The test pattern of the stage orb: 256 pairs of points, px from the feature, a bit "
        "each.\n"
        "// Derived by backends/benchmarks/orb_pattern.cpp from rendered scenes.\n"
        "#pragma once\n#include <cstdint>\n\n#include \"backends/shared/orb_constants.h\"\n\n"
        "namespace defrec::orb {\n\n"
        "// Test i compares points 2i and 2i + 1; x^2 + y^2 <= 210, so a turned and rounded point "
        "stays within 15 px.\n"
        "// clang-format off\nconstexpr int8_t kPattern[2 * kTests][2] = {");
    for (size_t i = 0; i < tests.size(); ++i)
        std::printf("%s{%d, %d}, {%d, %d},%s", i % 4 == 0 ? "    " : " ", tests[i]->first.x,
                    tests[i]->first.y, tests[i]->second.x, tests[i]->second.y,
                    i % 4 == 3 ? "\n" : "");
    std::puts("};\n// clang-format on\n\n}  // namespace defrec::orb");
}

void derive(const std::string& scenes) {
    std::vector<Sample> samples;
    for (const char* name : {"heartbeat", "indentation", "stretch", "heartbeat-360x288"})
        for (const ImagePair& pair : load_scene(scenes + "/" + name, name, {11, 22, 33, 44, 55}))
            add_samples(pair, samples);
    std::fprintf(stderr, "%zu features found again\n", samples.size());
    if (samples.empty()) throw std::runtime_error("no scenes in " + scenes);
    Random random;
    std::vector<Test> tests;
    while (tests.size() < kCandidates) {
        const orb::Offset a = random.point(), b = random.point();
        if ((a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y) < kShortest) continue;
        tests.push_back({a, b, 0, 0, {}});
        classify(tests.back(), samples);
    }
    std::stable_sort(tests.begin(), tests.end(),
                     [](const Test& a, const Test& b) { return a.goodness > b.goodness; });
    print(choose(tests, double(samples.size())));
}

}  // namespace

int main(int count, char** arguments) {
    try {
        if (count != 2) throw std::runtime_error("usage: defrec_orb_pattern SCENES");
        derive(arguments[1]);
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
